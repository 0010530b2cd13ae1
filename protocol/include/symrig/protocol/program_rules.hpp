// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/line_config.hpp"
#include "symrig/protocol/program.hpp"

namespace symrig::protocol {

/// What a program must keep to. Values are those of Violation.rule on the wire; never reused.
enum class Rule : uint8_t {
  none = 0,
  length = 1,         ///< empty, not whole records, or longer than the board's room
  bad_op = 2,         ///< no such operation; actual = op
  bad_arg = 3,        ///< bits set that mean nothing
  min_dwell = 4,      ///< a word held too shortly
  max_dwell = 5,      ///< a word held too long for one record, or a time-out of 0 or too long
  not_an_output = 6,  ///< a level for a line that is not a configured output
  not_an_input = 7,   ///< a wait on a line that is not an input
  loop_depth = 8,
  loop_balance = 9,  ///< a loop without end_loop, or the reverse
  loop_rounds = 10,  ///< 0 rounds, or more than kMaxRounds
  idle_loop = 11,    ///< a loop whose body takes no time
  mark_crowd = 12,   ///< more marks in a row than the board can keep
  no_end = 13,       ///< the last record is not End, or an End stands before it
  too_long = 14,     ///< runs longer than kMaxDuration
  max_on = 15,       ///< a line away from its safe level for too long
  min_off = 16,      ///< a line back from its safe level too soon
  duty = 17,         ///< too short a rest after a pulse
  refill = 18,       ///< words too short for too long: the engine's queue would run dry
  wait_kind = 19     ///< this board cannot wait for this edge on this line
};

constexpr uint64_t kMaxDuration = uint64_t{1} << 50U;  ///< ticks; 104 days at 125 MHz
constexpr uint32_t kMaxMarksInARow = 8;
constexpr uint32_t kMaxWaitsQueued = 128;  ///< waits that a board expands ahead of time

/// The board and its configuration, as far as programs must respect them.
struct ProgramRules {
  const BoardConfig* config = nullptr;
  uint32_t min_dwell = 1;
  uint32_t max_dwell = 0xFFFFFFFFU;
  uint32_t wait_latency = 0;  ///< ticks from an awaited edge, or its time-out, to the next word
  uint32_t max_bytes = 0;
  uint32_t loop_depth = kMaxLoopDepth;
  /// Edges that the board can NOT wait for, by line: bit 0 rising, 1 falling, 2 both.
  uint8_t no_waits[kMaxLines] = {};
  // What keeping the engine fed takes (hal/board.hpp). refill_ticks 0 = nothing.
  uint32_t queue_segments = 2;
  uint32_t refill_ticks = 0;
  uint32_t poll_ticks = 0;
};

/// One broken rule: actual against limit, in ticks where the rule is about time.
struct Violation {
  Rule rule = Rule::none;
  uint32_t record = 0;
  uint32_t line = 0;
  uint64_t actual = 0;
  uint64_t limit = 0;
};

/// What a sound program will take. Ticks.
struct ProgramTiming {
  uint64_t min = 0;    ///< every awaited edge comes at once
  uint64_t max = 0;    ///< every wait runs out
  uint64_t steps = 0;  ///< words put out, End's not counted
  uint64_t marks = 0;
};

/// How a sound program uses one output at worst: waits at their longest while it is on, at their shortest
/// while it rests. A line is off and rested before the program and after it.
struct LineUse {
  uint64_t worst_on = 0;             ///< ticks
  uint32_t worst_duty_permille = 0;  ///< of a pulse and the rest that follows it, rounded up
};

/// The rest that a duty limit asks for after a pulse of `on` ticks: off >= on (1000 - d) / d. on <=
/// kMaxDuration.
constexpr uint64_t rest_after(uint64_t on, uint16_t duty_permille) {
  if (duty_permille == 0 || duty_permille >= 1000) return 0;
  return (on * (1000U - duty_permille) + duty_permille - 1U) / duty_permille;
}

}  // namespace symrig::protocol
