// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/device/board.hpp"
#include "symrig/device/clock_model.hpp"

#include <optional>

namespace symrig {

/// A moment of the board on this machine's clock: |at - truth| <= bound.
struct SteadyMoment {
  device::SteadyTime at;
  Nanoseconds bound{0};
};

/// The board's clock against CLOCK_MONOTONIC, on which cameras stamp frames and screens stamp refreshes.
class SteadyClock {
 public:
  /// Forgets what it knew and reads the board's clock several times, so that a bound is there at once.
  Result<void> begin(device::Board& board);
  /// One more reading.  fails: device_lost (the board was restarted: its clock went back, or fits no clock
  /// within the limits of ClockModel), and as Board::time().
  Result<void> ask(device::Board& board);
  /// fails: bad_argument before begin(), limit.
  Result<SteadyMoment> at(device::Ticks ticks) const;

 private:
  std::optional<device::ClockModel> model_;
  device::SteadyTime opened_;
};

}  // namespace symrig
