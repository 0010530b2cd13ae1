// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/line_config.hpp"
#include "symrig/protocol/types.hpp"

namespace symrig::protocol {

constexpr size_t kRecordSize = 8;
constexpr unsigned kMaxLoopDepth = 4;
constexpr uint32_t kMaxArg = (uint32_t{1} << 28U) - 1;
constexpr uint64_t kMaxRounds = uint64_t{1} << 32U;

/// Operations of a program. Values are those of the wire. 0 is not an operation, so that empty memory is not
/// a program.
enum class Op : uint8_t {
  set_word = 1,   ///< arg = levels of lines 0..27; ticks = duration
  loop = 2,       ///< ticks = rounds, bit 0 of arg = bit 32 of the rounds
  end_loop = 3,   //
  wait_edge = 4,  ///< arg = line | edge << 5 | abort << 7; ticks = time-out
  mark = 5,       ///< arg = id
  end = 6         ///< arg = final levels of lines 0..27
};

enum class WaitFor : uint8_t { rising = 0, falling = 1, both = 2 };

/// One packed record: u32 (op << 28 | arg), u32 ticks, little endian.
struct Record {
  uint8_t op = 0;  ///< an Op, or an unknown number
  uint32_t arg = 0;
  uint32_t ticks = 0;

  constexpr bool is(Op wanted) const { return op == static_cast<uint8_t>(wanted); }
};

constexpr Record make_record(Op op, uint32_t arg, uint32_t ticks) {
  return {static_cast<uint8_t>(op), arg & kMaxArg, ticks};
}

/// rounds: 1 to kMaxRounds.
constexpr Record make_loop(uint64_t rounds) {
  return make_record(Op::loop, static_cast<uint32_t>(rounds >> 32U), static_cast<uint32_t>(rounds));
}

constexpr uint64_t loop_rounds(const Record& record) {
  return (uint64_t{record.arg} << 32U) | record.ticks;
}

struct WaitEdge {
  uint8_t line = 0;
  WaitFor edge = WaitFor::rising;
  bool abort_on_timeout = false;
};

constexpr Record make_wait(const WaitEdge& wait, uint32_t timeout) {
  const uint32_t arg = (wait.line & 31U) | (static_cast<uint32_t>(wait.edge) << 5U) |
                       (static_cast<uint32_t>(wait.abort_on_timeout) << 7U);
  return make_record(Op::wait_edge, arg, timeout);
}

/// false: bits without a meaning are set.
constexpr bool parse_wait(uint32_t arg, WaitEdge& wait) {
  const uint32_t edge = (arg >> 5U) & 3U;
  if (edge > 2 || arg >= 256) return false;
  wait = {static_cast<uint8_t>(arg & 31U), static_cast<WaitFor>(edge), (arg & 128U) != 0};
  return true;
}

constexpr void put_record(const Record& record, uint8_t* out) {
  put_u32(out, (uint32_t{record.op} << 28U) | record.arg);
  put_u32(out + 4, record.ticks);
}

constexpr Record get_record(const uint8_t* in) {
  const uint32_t word = get_u32(in);
  return {static_cast<uint8_t>(word >> 28U), word & kMaxArg, get_u32(in + 4)};
}

/// A view of a whole program.
struct ProgramView {
  ByteView bytes;

  constexpr uint32_t size() const { return static_cast<uint32_t>(bytes.size / kRecordSize); }
  constexpr Record operator[](uint32_t index) const { return get_record(bytes.data + index * kRecordSize); }
};

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
