// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/board.hpp"
#include "symrig/board/clock_model.hpp"

#include <deque>
#include <optional>

namespace symrig {

/// A moment of the board on this machine's clock: |at - truth| <= bound.
struct SteadyMoment {
  SteadyTime at;
  Nanoseconds bound{0};
};

/// The board's clock against CLOCK_MONOTONIC, on which cameras stamp frames and screens stamp refreshes.
/// ClockModel knows the last 32 seconds well. A run of the board may last many minutes, and its edges are
/// known at its end only: what the model knew while it ran is kept, for moments of the last hour.
class SteadyClock {
 public:
  /// Forgets what it knew and reads the board's clock several times, so that a bound is there at once.
  Result<void> begin(Board& board);
  /// One more reading.  fails: device_lost (the board was restarted: its clock went back, or fits no clock
  /// within the limits of ClockModel), and as Board::time().
  Result<void> ask(Board& board);
  /// fails: bad_argument before begin(), limit.
  Result<SteadyMoment> at(Ticks ticks) const;

 private:
  /// The model as it was after a reading.
  struct Past {
    BoardTime taken;
    HostTime received;
    ClockModel model;
  };

  void keep(const TimeReading& reading);
  const ClockModel& model_for(BoardTime moment) const;

  std::optional<ClockModel> model_;
  std::deque<Past> past_;  // the newest last
  SteadyTime opened_;
};

}  // namespace symrig
