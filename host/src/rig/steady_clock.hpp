// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/board.hpp"
#include "symrig/board/clock_model.hpp"

#include <deque>
#include <optional>

namespace symrig {

/// A moment of the board on this computer's clock: |at - truth| <= bound.
struct SteadyMoment {
  SteadyTime at;
  Nanoseconds bound{0};
};

/// Converts the board's clock to CLOCK_MONOTONIC, which stamps frames and refreshes. ClockModel is good for
/// the last 32 seconds. A run of the board may last many minutes, and its edges are known only at its end. So
/// this class keeps the models of the last hour.
class SteadyClock {
 public:
  /// Discards all readings, and reads the board's clock several times. A bound is then available at once.
  Result<void> begin(Board& board);
  /// Adds a reading.
  /// fails: device_lost (the board was restarted: its clock went back or left the limits of ClockModel), and
  /// as Board::time().
  Result<void> ask(Board& board);
  /// fails: bad_argument before begin(), limit.
  Result<SteadyMoment> at(Ticks ticks) const;
  /// The board's clock at a moment that is not long ago, or soon.
  /// fails: as at().
  Result<Ticks> ticks_at(SteadyTime time) const;

 private:
  /// The model after a reading.
  struct Past {
    BoardTime taken;
    HostTime received;
    ClockModel model;
  };

  void keep(const TimeReading& reading);
  const ClockModel& model_for(BoardTime moment) const;

  std::optional<ClockModel> model_;
  std::deque<Past> past_;  // newest last
  SteadyTime opened_;
};

}  // namespace symrig
