// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gpio.hpp"
#include "symrig/base/result.hpp"
#include "symrig/boards/playback.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

namespace symrig::board_linux {

/// The smallest, the median and the largest of several times, in ticks.
struct Spread {
  std::uint64_t least = 0;
  std::uint64_t median = 0;
  std::uint64_t most = 0;
};

/// The measured times of this computer, at the player's priority.
struct Measured {
  unsigned wakes = 0;  ///< number of timed sleeps
  Spread wake;         ///< how late a sleep ends
  Spread word;         ///< how late a word is on the outputs, after a sleep and watching the clock
  Spread set;          ///< duration of one call that sets all outputs
  Spread nudge;        ///< from an event in one thread to the thread that waits for it
  Spread push;         ///< duration of queueing one segment
};

/// Sleeps `wakes` times for half a millisecond. Each time sets the outputs to `levels` (which they already
/// have) and wakes a thread. Takes about 1.2 ms per wake. The caller's thread gets the priority if that is
/// permitted.
/// priority: of SCHED_FIFO, 0 = ordinary. The times include the present load of the computer.
Measured measure(Gpio& gpio, std::uint32_t levels, unsigned wakes, int priority);

/// The worse of both in each field, because what happened once can happen again.
Measured worse(const Measured& a, const Measured& b);

/// The abilities that a board on such a computer can promise.
struct Abilities {
  board_common::Promise promise;
  std::uint64_t spin = 0;  ///< time of watching the clock before each word
  std::uint32_t output_stamp = 1;
  std::uint32_t input_stamp = 1;
  std::uint32_t refill_ticks = 1;
  std::uint32_t poll_ticks = 1;
};

/// Promises twice the worst measured time, limited to 200 ms. A computer that is later is no use as a trigger
/// board.
/// lateness: the user's allowed lateness of a word in ticks; later words are counted. 0 = as measured. queue:
/// number of segments in the player's queue.
Abilities abilities(const Measured& measured, std::uint32_t lateness, std::size_t queue);

/// The text that `symrigd --measure` prints.
std::string measured_text(const Measured& measured, const Abilities& abilities);

/// Stores the kernel's release, too. load_measured() ignores a file from another kernel.
/// fails: io (cannot write).
Result<void> save_measured(const std::filesystem::path& path, const Measured& measured);
/// All zeros without a file.
Measured load_measured(const std::filesystem::path& path);

}  // namespace symrig::board_linux
