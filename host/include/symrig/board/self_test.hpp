// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/board.hpp"
#include "symrig/board/jumper.hpp"

#include <optional>
#include <string>
#include <vector>

namespace symrig {

struct SelfTestOptions {
  int pings = 30;                    ///< readings of the board's clock, at least 1
  Nanoseconds between{100'000'000};  ///< between two readings; the first eight have no pause
  std::optional<Jumper> jumper = {};
  Progress progress = {};  ///< of the clock readings
};

/// Round-trip times of the clock readings.
struct PingTimes {
  Nanoseconds shortest{0}, median{0}, longest{0};
};

/// A pulse: planned at the output, measured at the input.
struct JumperPulse {
  Ticks planned, measured;
  Ticks delay;  ///< from the planned rising edge to the captured one
};

/// One result of the self-test.
struct SelfCheck {
  std::string name;  ///< "identity", "abilities", "state", "clock", "memory", "jumper"
  bool passed = false;
  std::string text;  ///< the finding in one line
};

struct SelfTest {
  std::vector<SelfCheck> checks;
  PingTimes pings;
  Nanoseconds clock_bound{0};  ///< bound of the clock model after the last reading
  DriftEstimate drift;
  Ticks stamp_error;  ///< largest error of a measured width with a good jumper
  std::vector<JumperPulse> pulses;

  bool passed() const;
};

/// Tests a board without any wiring, or with one jumper. Erases the board's configuration and program.
/// Without a jumper no output changes. A check that fails does not end the test.
///
/// jumper: pulses of widths from 8 resolutions of the input (and min_dwell) to 80 ms, each eight times the
/// one before. The stamp of an edge is late by less than one resolution of the input, plus or minus one tick
/// of the input's synchroniser. So a width is wrong by at most one resolution and one tick.
///
/// fails: unknown_name, bad_argument (the jumper's lines), device_refused (a program runs, or an output is
/// limited), as Board.
Result<SelfTest> self_test(Board& board, const SelfTestOptions& options);

}  // namespace symrig
