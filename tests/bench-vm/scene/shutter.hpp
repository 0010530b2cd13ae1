// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/time.hpp"

#include <cstdint>

namespace symrig::bench_vm {

/// The timing of a camera in trigger-width mode, as board_sim::SimCamera has in virtual time. It exposes
/// while its trigger line is high. It misses a trigger that rises while it reads out the previous frame.
class Shutter {
 public:
  enum class Move : std::uint8_t { none, open, close };

  explicit Shutter(Nanoseconds readout) : readout_(readout) {}

  /// The trigger line was set, possibly to the level that it had.
  /// sees: the camera sees it if it rises. One that it does not see gives no exposure.
  Move trigger(bool level, Nanoseconds at, bool sees = true);
  /// Number of times that the line rose.
  std::uint64_t triggers() const { return triggers_; }
  /// Number of triggers that came too early.
  std::uint64_t missed() const { return missed_; }
  /// Number of triggers that were not seen.
  std::uint64_t unseen() const { return unseen_; }
  bool is_open() const { return open_; }

 private:
  Nanoseconds readout_;
  Nanoseconds busy_until_{};
  std::uint64_t triggers_ = 0;
  std::uint64_t missed_ = 0;
  std::uint64_t unseen_ = 0;
  bool level_ = false;
  bool open_ = false;
};

}  // namespace symrig::bench_vm
