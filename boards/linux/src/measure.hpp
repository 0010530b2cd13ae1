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

/// The smallest, middle and largest of some times, ticks.
struct Spread {
  std::uint64_t least = 0;
  std::uint64_t median = 0;
  std::uint64_t most = 0;
};

/// What this machine did when it was asked, at the player's priority.
struct Measured {
  unsigned wakes = 0;  ///< sleeps that were timed
  Spread wake;         ///< how late a sleep ends
  Spread word;         ///< how late a word stands on the outputs after a sleep and watching the clock
  Spread set;          ///< one call that sets all outputs
  Spread nudge;        ///< from an event in one thread to another that waits for it
  Spread push;         ///< one segment into the queue
};

/// Sleeps `wakes` times for half a millisecond, sets the outputs to `levels` (which they have) as often, and
/// wakes a thread. Takes about 1.2 ms a wake. The caller's thread gets the priority if it may.
/// priority: of SCHED_FIFO, 0 = ordinary. The numbers are what the machine did meanwhile, load and all.
Measured measure(Gpio& gpio, std::uint32_t levels, unsigned wakes, int priority);

/// The worse of both: what was seen once can come again.
Measured worse(const Measured& a, const Measured& b);

/// What can be promised on such a machine.
struct Abilities {
  board_common::Promise promise;
  std::uint64_t spin = 0;  ///< before each word
  std::uint32_t output_stamp = 1;
  std::uint32_t input_stamp = 1;
  std::uint32_t refill_ticks = 1;
  std::uint32_t poll_ticks = 1;
};

/// Twice the worst that was seen, but for 200 ms: a machine that is later is no trigger board at all.
/// lateness: how late a word may go out because the user says so (what is later is counted), ticks; 0 = as
/// measured. queue: segments that the player keeps.
Abilities abilities(const Measured& measured, std::uint32_t lateness, std::size_t queue);

/// The table that `symrigd --measure` prints.
std::string measured_text(const Measured& measured, const Abilities& abilities);

/// Kept with the kernel's release; a file of another kernel counts as none.
/// fails: io (not written).
Result<void> save_measured(const std::filesystem::path& path, const Measured& measured);
/// All zero if there is none.
Measured load_measured(const std::filesystem::path& path);

}  // namespace symrig::board_linux
