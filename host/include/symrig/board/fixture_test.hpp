// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/self_test.hpp"

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace symrig {

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
