// SPDX-License-Identifier: Apache-2.0
// The board's validator. For each rule, one program breaks only this rule; the refusal must name rule and
// record.
#include "conformance/board_under_test.hpp"
#include "conformance/plan.hpp"
#include "symrig/protocol/check_program.hpp"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::conformance {
namespace {

using namespace std::chrono_literals;
using protocol::Op;
using protocol::raw;
using protocol::Rule;
using protocol::WaitFor;

Verdict breaks(BoardUnderTest& board, const Bytes& program, Rule rule, std::uint32_t record) {
  SYMRIG_MUST(board.configure());
  SYMRIG_MUST(board.send_program(program));
  symrig_wire_Request request = make_request(symrig_wire_Request_program_commit_tag);
  request.body.program_commit = {board.program_id, protocol::crc32c({program.data(), program.size()})};
  const auto reply = board.session.ask(request);
  SYMRIG_MUST(
      code_is("program_commit", symrig_wire_Code_CODE_BAD_PROGRAM, reply ? raw(reply->code) : kNoCode));
  SYMRIG_MUST(same("body of the refusal", symrig_wire_Reply_violation_tag, reply->which_body));
  SYMRIG_MUST(same("rule", static_cast<std::uint64_t>(rule), reply->body.violation.rule));
  SYMRIG_MUST(same("record", record, reply->body.violation.record));
  return board.in_state(symrig_wire_State_STATE_CONFIGURED);
}

std::uint32_t lit(const BoardUnderTest& board) {
  return 1U << board.outputs().front();
}

Verdict length(BoardUnderTest& board) {
  SYMRIG_MUST(board.configure());
  symrig_wire_Request request = make_request(symrig_wire_Request_program_begin_tag);
  request.body.program_begin = {1, board.can.program_bytes + 8};
  const auto reply = board.session.ask(request);
  SYMRIG_MUST(code_is("a program that is too long", symrig_wire_Code_CODE_TOO_LONG,
                      reply ? raw(reply->code) : kNoCode));
  SYMRIG_MUST(same("detail", board.can.program_bytes, reply->detail));
  SYMRIG_MUST(code_is("a program of 0 bytes", symrig_wire_Code_CODE_BAD_VALUE, board.program_begin(0)));
  return code_is("a program of 12 bytes", symrig_wire_Code_CODE_BAD_VALUE, board.program_begin(12));
}

Verdict bad_op(BoardUnderTest& board) {
  return breaks(board, pack({word(0, board.word()), {9, 0, 0}, end()}), Rule::bad_op, 1);
}

Verdict bad_arg(BoardUnderTest& board) {
  return breaks(board, pack({word(0, board.word()), {static_cast<std::uint8_t>(Op::mark), 1, 5}, end()}),
                Rule::bad_arg, 1);
}

Verdict min_dwell(BoardUnderTest& board) {
  return breaks(board, pack({word(0, board.word()), word(lit(board), board.can.min_dwell - 1), end()}),
                Rule::min_dwell, 1);
}

/// A board that accepts words of any length still refuses a time-out of 0.
Verdict max_dwell(BoardUnderTest& board) {
  if (board.can.max_dwell < UINT32_MAX)
    return breaks(board, pack({word(0, board.can.max_dwell + 1), end()}), Rule::max_dwell, 0);
  for (const std::uint32_t input : board.inputs())
    if ((board.lines[input].waits & 1U) != 0)
      return breaks(board, pack({word(0, board.word()), wait(input, WaitFor::rising, false, 0), end()}),
                    Rule::max_dwell, 1);
  return skipped("words of any length are legal, and the board cannot wait for any input");
}

Verdict level_without_output(BoardUnderTest& board) {
  std::uint32_t outputs = 0;
  for (const std::uint32_t line : board.outputs()) outputs |= 1U << line;
  for (std::uint32_t k = 0; k < protocol::kMaxOutputs; ++k)
    if (((outputs >> k) & 1U) == 0)
      return breaks(board, pack({word(1U << k, board.word()), end()}), Rule::not_an_output, 0);
  return skipped("all of the first 28 lines are outputs");
}

Verdict not_an_input(BoardUnderTest& board) {
  const std::uint32_t output = board.outputs().front();
  return breaks(board,
                pack({word(0, board.word()), wait(output, WaitFor::rising, false, board.word()), end()}),
                Rule::not_an_input, 1);
}

Verdict wait_kind(BoardUnderTest& board) {
  for (const std::uint32_t input : board.inputs())
    for (std::uint8_t edge = 0; edge < 3; ++edge)
      if (((board.lines[input].waits >> edge) & 1U) == 0)
        return breaks(board,
                      pack({word(0, board.word()),
                            wait(input, static_cast<WaitFor>(edge), false, board.word()), end()}),
                      Rule::wait_kind, 1);
  return skipped("the board can wait for every edge of every input");
}

Verdict loop_depth(BoardUnderTest& board) {
  Bytes program;
  const auto add = [&](const Bytes& part) { program.insert(program.end(), part.begin(), part.end()); };
  for (std::uint32_t k = 0; k <= board.can.loop_depth; ++k) add(pack({loop(2)}));
  add(pack({word(0, board.word())}));
  for (std::uint32_t k = 0; k <= board.can.loop_depth; ++k) add(pack({end_loop()}));
  add(pack({end()}));
  return breaks(board, program, Rule::loop_depth, board.can.loop_depth);
}

Verdict loop_balance(BoardUnderTest& board) {
  return breaks(board, pack({word(0, board.word()), end_loop(), end()}), Rule::loop_balance, 1);
}

Verdict loop_rounds(BoardUnderTest& board) {
  return breaks(board, pack({loop(0), word(0, board.word()), end_loop(), end()}), Rule::loop_rounds, 0);
}

Verdict idle_loop(BoardUnderTest& board) {
  return breaks(board, pack({word(0, board.word()), loop(2), mark(1), end_loop(), end()}), Rule::idle_loop,
                3);
}

Verdict mark_crowd(BoardUnderTest& board) {
  return breaks(board,
                pack({mark(0), mark(1), mark(2), mark(3), mark(4), mark(5), mark(6), mark(7), mark(8),
                      word(0, board.word()), end()}),
                Rule::mark_crowd, 8);
}

Verdict no_end(BoardUnderTest& board) {
  return breaks(board, pack({word(0, board.word()), word(0, board.word())}), Rule::no_end, 1);
}

/// 2^32 rounds of words: their sum is more than 2^50 ticks.
Verdict too_long(BoardUnderTest& board) {
  const std::uint32_t ticks = std::max(board.word(), 1U << 18U);
  return breaks(board, pack({loop(protocol::kMaxRounds), word(0, ticks), end_loop(), end()}), Rule::too_long,
                2);
}

/// A program that breaks the limit of an output that the board stamps.
Verdict breaks_limit(BoardUnderTest& board, Rule rule, std::uint32_t record, std::uint32_t on,
                     std::uint32_t off, const protocol::LineConfig& limits) {
  const auto line = board.seen_output();
  if (!line) return skipped("the board stamps no edges of its outputs, so it accepts no limits");
  board.config.lines[*line].max_on = limits.max_on;
  board.config.lines[*line].min_off = limits.min_off;
  board.config.lines[*line].max_duty_permille = limits.max_duty_permille;
  const std::uint32_t bit = 1U << *line;
  SYMRIG_MUST(breaks(board, pack({word(bit, on), word(0, off), word(bit, on), end()}), rule, record));
  SYMRIG_MUST(board.start_afresh());
  return {};
}

Verdict max_on(BoardUnderTest& board) {
  protocol::LineConfig limits;
  limits.max_on = board.word() - 1;
  return breaks_limit(board, Rule::max_on, 0, board.word(), board.word(), limits);
}
Verdict min_off(BoardUnderTest& board) {
  protocol::LineConfig limits;
  limits.min_off = board.word() + 1;
  return breaks_limit(board, Rule::min_off, 2, board.word(), board.word(), limits);
}
Verdict duty(BoardUnderTest& board) {
  protocol::LineConfig limits;
  limits.max_duty_permille = 499;
  return breaks_limit(board, Rule::duty, 2, board.word(), board.word(), limits);
}

/// The shortest words in an endless loop.
Verdict refill(BoardUnderTest& board) {
  const std::uint32_t cost = board.can.refill_ticks;
  if (cost <= board.can.min_dwell) return skipped("the board keeps up with its shortest words");
  const Bytes program = pack({loop(1'000'000), word(lit(board), board.can.min_dwell),
                              word(0, board.can.min_dwell), end_loop(), end()});
  protocol::Violation first;
  protocol::ProgramTiming timing;
  protocol::check_program({{program.data(), program.size()}}, board.rules(), timing,
                          [&](const protocol::Violation& found) {
                            first = found;
                            return false;
                          });
  if (first.rule != Rule::refill) return skipped("the board keeps up with its shortest words");
  return breaks(board, program, Rule::refill, first.record);
}

constexpr std::array<Check, 19> kRuleChecks{{
    {"rules.length", "1: empty, not whole records, or too long", length},
    {"rules.bad_op", "2: an operation that does not exist", bad_op},
    {"rules.bad_arg", "3: bits without a meaning", bad_arg},
    {"rules.min_dwell", "4: a word that is too short", min_dwell},
    {"rules.max_dwell", "5: a word that is too long, or a time-out of 0", max_dwell},
    {"rules.not_an_output", "6: a level for a line that is not an output", level_without_output},
    {"rules.not_an_input", "7: a wait on a line that is not an input", not_an_input},
    {"rules.loop_depth", "8: too many nested loops", loop_depth},
    {"rules.loop_balance", "9: end_loop without a loop", loop_balance},
    {"rules.loop_rounds", "10: a loop of 0 rounds", loop_rounds},
    {"rules.idle_loop", "11: a loop that takes no time", idle_loop},
    {"rules.mark_crowd", "12: nine marks in a row", mark_crowd},
    {"rules.no_end", "13: no End", no_end},
    {"rules.too_long", "14: a duration of 2^50 ticks or more", too_long},
    {"rules.max_on", "15: on for too long", max_on},
    {"rules.min_off", "16: off for too short", min_off},
    {"rules.duty", "17: too little rest after a pulse", duty},
    {"rules.refill", "18: too many short words", refill},
    {"rules.wait_kind", "19: an edge that the board cannot wait for", wait_kind},
}};

}  // namespace

std::span<const Check> rule_checks() {
  return kRuleChecks;
}

}  // namespace symrig::conformance
