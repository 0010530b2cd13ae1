// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/base/units.hpp"
#include "symrig/board/board.hpp"
#include "symrig/board/jumper.hpp"

#include <optional>
#include <string>
#include <vector>

namespace symrig {

struct SelfTestOptions {
  int pings = 30;                    ///< questions for the clock, at least 1
  Nanoseconds between{100'000'000};  ///< from one to the next; the first eight follow each other at once
  std::optional<Jumper> jumper = {};
  Progress progress = {};  ///< of the questions for the clock
};

/// Round trips of the questions for the clock.
struct PingTimes {
  Nanoseconds shortest{0}, median{0}, longest{0};
};

/// A pulse as it was planned at the output and measured at the input.
struct JumperPulse {
  Ticks planned, measured;
  Ticks delay;  ///< from the planned rising edge to the one that was seen
};

/// One thing that was looked at.
struct SelfCheck {
  std::string name;  ///< "identity", "abilities", "state", "clock", "memory", "jumper"
  bool passed = false;
  std::string text;  ///< what was found, in one line
};

struct SelfTest {
  std::vector<SelfCheck> checks;
  PingTimes pings;
  Nanoseconds clock_bound{0};  ///< of the host's idea of the board's clock, after the last question
  DriftEstimate drift;
  Ticks stamp_error;  ///< a sound jumper's widths are off by at most this
  std::vector<JumperPulse> pulses;

  bool passed() const;
};

/// What a board can be asked and made to do without anything wired to it, and with one jumper. Takes the
/// board's configuration and program away; without a jumper no output moves. A check that fails does not end
/// the test.
///
/// jumper: pulses of widths from 8 resolutions of the input (and min_dwell) to 80 ms, each eight times the
/// one before. Each edge's stamp is late by less than one resolution of the input, and by one tick more or
/// less for the input's synchroniser, so a width is off by at most a resolution and a tick.
///
/// fails: unknown_name, bad_argument (the jumper's lines), device_refused (a program runs, or an output is
/// limited), as Board.
Result<SelfTest> self_test(Board& board, const SelfTestOptions& options);

}  // namespace symrig
