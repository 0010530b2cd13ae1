// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

namespace symrig::fuzz {

/// Stops the process where an invariant is broken: libFuzzer keeps the input, GoogleTest shows the death.
inline void require(bool holds, const char* invariant) {
  if (holds) return;
  (void)std::fprintf(stderr, "broken invariant: %s\n", invariant);
  std::abort();
}

/// Frame decoder: whatever comes out of it encodes to bytes that come out the same.
void fuzz_frame(const std::uint8_t* data, std::size_t size);
/// Message bodies: what decodes encodes within its bound and decodes to the same bytes.
void fuzz_messages(const std::uint8_t* data, std::size_t size);
/// The board's end of the wire: sequence, sessions, urgent requests against a model of PROTOCOL.md; the
/// urgent abort is found in an interrupt exactly where the link obeys it.
void fuzz_link(const std::uint8_t* data, std::size_t size);
/// Rule refill: what it passes never runs dry, with a filler as slow and as late as the board says it may be.
void fuzz_refill(const std::uint8_t* data, std::size_t size);
/// The record that a board keeps over power-off: whatever is in flash, what is loaded fits the board.
void fuzz_settings(const std::uint8_t* data, std::size_t size);
/// The host against a board that lies: nothing crashes, every call ends within its attempts.
void fuzz_reply(const std::uint8_t* data, std::size_t size);
/// The host against a camera's driver that answers whatever it likes: nothing crashes, nothing is read beyond
/// a buffer, every call ends.
void fuzz_camera(const std::uint8_t* data, std::size_t size);
/// HDF5 files whose structure is damaged: a scene or a matrix is read, or refused in one line.
void fuzz_hdf5(const std::uint8_t* data, std::size_t size);
/// Program rules and sequencer: a program that passes runs, in the time that was foretold, with as many
/// words.
void fuzz_program(const std::uint8_t* data, std::size_t size);
/// The whole firmware on the simulated board, driven by bytes, time, inputs, stalls and resets: FAULT and
/// SAFE mean safe levels, and so does an open interlock; a lamp never outlives its limit, an abort always
/// makes safe, and a new session can always begin.
void fuzz_board(const std::uint8_t* data, std::size_t size);

}  // namespace symrig::fuzz
