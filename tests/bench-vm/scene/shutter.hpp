// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/units.hpp"

#include <cstdint>

namespace symrig::bench_vm {

/// The timing of a camera in trigger-width mode, as board_sim::SimCamera has in virtual time. It exposes
/// while its trigger line is high. It misses a trigger that rises while it reads out the previous frame.
class Shutter {
 public:
  enum class Move : std::uint8_t { none, open, close };

  explicit Shutter(Nanoseconds readout) : readout_(readout) {}

  /// The trigger line was set, possibly to the level that it had.
  Move trigger(bool level, Nanoseconds at);
  /// Number of triggers that came too early.
  std::uint64_t missed() const { return missed_; }
  bool is_open() const { return open_; }

 private:
  Nanoseconds readout_;
  Nanoseconds busy_until_{};
  std::uint64_t missed_ = 0;
  bool level_ = false;
  bool open_ = false;
};

}  // namespace symrig::bench_vm
