// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/line_config.hpp"
#include "symrig/protocol/program.hpp"

namespace symrig::protocol {

/// The rules for programs. Values are those of Violation.rule on the wire, and never reused.
enum class Rule : uint8_t {
  none = 0,
  length = 1,         ///< empty, not whole records, or longer than the board's memory
  bad_op = 2,         ///< the operation does not exist; actual = op
  bad_arg = 3,        ///< bits without a meaning are set
  min_dwell = 4,      ///< a word that is too short
  max_dwell = 5,      ///< a word that is too long for one record, or a time-out that is 0 or too long
  not_an_output = 6,  ///< a level for a line that is not a configured output
  not_an_input = 7,   ///< a wait on a line that is not an input
  loop_depth = 8,
  loop_balance = 9,  ///< a loop without end_loop, or the reverse
  loop_rounds = 10,  ///< 0 rounds, or more than kMaxRounds
  idle_loop = 11,    ///< a loop whose body takes no time
  mark_crowd = 12,   ///< more marks in a row than the board can keep
  no_end = 13,       ///< the last record is not End, or there is an End before it
  too_long = 14,     ///< runs longer than kMaxDuration
  max_on = 15,       ///< a line away from its safe level for too long
  min_off = 16,      ///< a line at its safe level for too short
  duty = 17,         ///< too short a rest after a pulse
  refill = 18,       ///< too many short words: the engine's queue would run empty
  wait_kind = 19     ///< this board cannot wait for this edge on this line
};

constexpr uint64_t kMaxDuration = uint64_t{1} << 50U;  ///< ticks; 104 days at 125 MHz
constexpr uint32_t kMaxMarksInARow = 8;
constexpr uint32_t kMaxWaitsQueued = 128;  ///< waits that a board expands ahead of time

/// The properties of the board and its configuration that limit programs.
struct ProgramRules {
  const BoardConfig* config = nullptr;
  uint32_t min_dwell = 1;
  uint32_t max_dwell = 0xFFFFFFFFU;
  uint32_t wait_latency = 0;  ///< ticks from an awaited edge, or its time-out, to the next word
  uint32_t max_bytes = 0;
  uint32_t loop_depth = kMaxLoopDepth;
  /// Edges that the board can NOT wait for, by line: bit 0 rising, 1 falling, 2 both.
  uint8_t no_waits[kMaxLines] = {};
  // The cost of keeping the engine's queue filled (hal/board.hpp). refill_ticks 0 = no cost.
  uint32_t queue_segments = 2;
  uint32_t refill_ticks = 0;
  uint32_t poll_ticks = 0;
};

/// One broken rule, with the actual value and the limit: in ticks if the rule is about time.
struct Violation {
  Rule rule = Rule::none;
  uint32_t record = 0;
  uint32_t line = 0;
  uint64_t actual = 0;
  uint64_t limit = 0;
};

/// The duration of a valid program in ticks.
struct ProgramTiming {
  uint64_t min = 0;    ///< every awaited edge comes at once
  uint64_t max = 0;    ///< every wait times out
  uint64_t steps = 0;  ///< words that go out, without that of End
  uint64_t marks = 0;
};

/// The worst use of one output by a valid program: waits are longest while it is on, and shortest while it
/// rests. A line is off and rested before the program and after it.
struct LineUse {
  uint64_t worst_on = 0;             ///< ticks
  uint32_t worst_duty_permille = 0;  ///< on / (on + the rest that follows), rounded up
};

/// The rest that a duty limit requires after a pulse of `on` ticks: off >= on (1000 - d) / d. on <=
/// kMaxDuration.
constexpr uint64_t rest_after(uint64_t on, uint16_t duty_permille) {
  if (duty_permille == 0 || duty_permille >= 1000) return 0;
  return (on * (1000U - duty_permille) + duty_permille - 1U) / duty_permille;
}

}  // namespace symrig::protocol
