// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/board.hpp"
#include "symrig/board/link.hpp"

#include <functional>
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

/// What one wire of the plug showed.
struct WireTest {
  Jumper wire;
  bool passed = false;
  std::string text;  ///< the finding in one line
  std::vector<JumperPulse> pulses;
};

/// The time from an interlock's edge to safe outputs, both stamped at inputs of the board.
struct TripTest {
  bool passed = false;
  std::string text;
  std::string interlock;         ///< the input that tripped
  std::optional<Ticks> latency;  ///< none: no falling edge was captured
  Ticks resolution;              ///< of both stamps together: the latency is known to this
};

/// A watchdog that the firmware feeds no more must reset the board.
struct WatchdogTest {
  bool passed = false;
  std::string text;
  std::optional<Ticks> answered;    ///< the board still answered for so long; none: it was not reset
  std::optional<ResetCause> cause;  ///< why the board says that it has started again
};

/// Opens the same board again, if its link ends with a reset (USB). Empty: the link outlives a reset.
using Reconnect = std::function<Result<Board>()>;

struct FixtureTest {
  SelfTest basics;
  std::vector<WireTest> wires;
  SelfCheck crossing;  ///< each pulse arrived at its own input only
  TripTest trip;
  WatchdogTest watchdog;

  bool passed() const;
};

/// The plug of the production test: the k-th output with the k-th input, as many as there are of both.
std::vector<Jumper> default_plug(const BoardInfo& board);

/// Tests a board whose outputs a plug connects with its inputs: the self-test, pulses through each wire,
/// whether a pulse appears at another input, how long an interlock takes to make the outputs safe, and
/// whether the watchdog resets the board. The board restarts twice, and `board` has a new session then.
/// Outputs change: nothing but the plug may be connected. Erases the board's configuration and program. plug:
/// at least two wires; each line at most once. One input must be able to be an interlock. Every input must
/// stamp edges.
/// A trip may take 10 us, and 1 ms on a best-effort board, besides the stamps' resolution.
/// fails: unknown_name, bad_argument (the plug), device_refused (a program runs), as Board.
Result<FixtureTest> fixture_test(Board& board, const std::vector<Jumper>& plug,
                                 const SelfTestOptions& options, const Reconnect& reconnect = {});

}  // namespace symrig
