// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/device/board.hpp"
#include "symrig/device/clock_model.hpp"

#include <deque>
#include <optional>

namespace symrig {

/// A moment of the board on this machine's clock: |at - truth| <= bound.
struct SteadyMoment {
  device::SteadyTime at;
  Nanoseconds bound{0};
};

/// The board's clock against CLOCK_MONOTONIC, on which cameras stamp frames and screens stamp refreshes.
/// ClockModel knows the last 32 seconds well. A run of the board may last many minutes, and its edges are
/// known at its end only: what the model knew while it ran is kept, for moments of the last hour.
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
  /// The model as it was after a reading.
  struct Past {
    device::BoardTime taken;
    device::HostTime received;
    device::ClockModel model;
  };

  void keep(const device::TimeReading& reading);
  const device::ClockModel& model_for(device::BoardTime moment) const;

  std::optional<device::ClockModel> model_;
  std::deque<Past> past_;  // the newest last
  device::SteadyTime opened_;
};

}  // namespace symrig
