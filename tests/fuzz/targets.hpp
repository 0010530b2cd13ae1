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
  std::fprintf(stderr, "broken invariant: %s\n", invariant);
  std::abort();
}

/// Frame decoder: whatever comes out of it encodes to bytes that come out the same.
void fuzz_frame(const std::uint8_t* data, std::size_t size);
/// Message bodies: what decodes encodes within its bound and decodes to the same bytes.
void fuzz_messages(const std::uint8_t* data, std::size_t size);
/// Program rules and sequencer: a program that passes runs, in the time that was foretold, with as many
/// words.
void fuzz_program(const std::uint8_t* data, std::size_t size);
/// The whole firmware on the simulated board, driven by bytes and time: FAULT and SAFE mean safe levels, a
/// lamp never outlives its limit, an abort always makes safe, and a new session can always begin.
void fuzz_board(const std::uint8_t* data, std::size_t size);

}  // namespace symrig::fuzz
