// SPDX-License-Identifier: Apache-2.0
// An input that stops the board. Without a wire, a check "opens" the interlock: it configures the present
// level as the trip level.
#include "conformance/board_under_test.hpp"
#include "conformance/plan.hpp"

#include <algorithm>
#include <array>
#include <optional>

namespace symrig::conformance {
namespace {

using namespace std::chrono_literals;
using protocol::raw;

std::optional<std::uint32_t> interlock(const BoardUnderTest& board) {
  for (const std::uint32_t line : board.inputs())
    if (board.lines[line].trips) return line;
  return std::nullopt;
}
Verdict none() {
  return skipped("no input can be an interlock");
}

/// Configures an interlock on `line` that trips at its present level (open), or at the other one.
Verdict set_up(BoardUnderTest& board, std::uint32_t line, bool open) {
  const auto now = board.status();
  if (!now) return failed("no answer to get_status");
  const bool level = ((now->levels >> line) & 1U) != 0;
  board.config.lines[line].role = symrig_wire_LineRole_LINE_ROLE_INTERLOCK;
  board.config.lines[line].trip_level = open ? level : !level;
  return board.configure();
}

Verdict open_refuses(BoardUnderTest& board) {
  const auto line = interlock(board);
  if (!line) return none();
  SYMRIG_MUST(set_up(board, *line, true));
  SYMRIG_MUST(board.upload(pack({word(0, board.word()), end()})));
  symrig_wire_Request request = make_request(symrig_wire_Request_arm_tag);
  request.body.arm = {board.program_hash, board.config_hash, false};
  const auto reply = board.session.ask(request);
  SYMRIG_MUST(code_is("arm with an open interlock", symrig_wire_Code_CODE_INTERLOCK_OPEN,
                      reply ? raw(reply->code) : kNoCode));
  SYMRIG_MUST(same("detail, the line", *line, reply->detail));
  const std::uint32_t output = 1U << board.outputs().front();
  return code_is("manual_set with an open interlock", symrig_wire_Code_CODE_INTERLOCK_OPEN,
                 board.manual_set(output, output));
}

Verdict closed_allows(BoardUnderTest& board) {
  const auto line = interlock(board);
  if (!line) return none();
  SYMRIG_MUST(set_up(board, *line, false));
  SYMRIG_MUST(board.upload(pack({word(0, board.word()), end()})));
  SYMRIG_MUST(code_is("arm with a closed interlock", symrig_wire_Code_CODE_OK, board.arm()));
  SYMRIG_MUST(code_is("start", symrig_wire_Code_CODE_OK, board.start()));
  return board.await_done(1s);
}

Verdict not_an_output(BoardUnderTest& board) {
  const std::uint32_t line = board.outputs().front();
  board.config.lines[line].role = symrig_wire_LineRole_LINE_ROLE_INTERLOCK;
  return code_is("an output as an interlock", symrig_wire_Code_CODE_BAD_VALUE, board.config_line(line));
}

/// With the jumper, the program itself opens the interlock: from its second word on, for `opening` ticks.
Verdict opened_by_a_run(BoardUnderTest& board, std::uint32_t opening, bool closes_again) {
  if (!board.jumper) return skipped("needs a jumper from an output to an input");
  const auto [output, input] = *board.jumper;
  if (!board.lines[input].trips) return skipped("the jumper's input cannot be an interlock");
  board.config.lines[input].role = symrig_wire_LineRole_LINE_ROLE_INTERLOCK;
  board.config.lines[input].trip_level = true;
  const std::uint32_t bit = 1U << output;
  const std::uint32_t later = closes_again ? 0 : bit;
  SYMRIG_MUST(board.load(pack({word(0, board.word()), word(bit, opening), loop(10'000),
                               word(later, board.word()), end_loop(), end(later)})));
  SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_OK, board.arm()));
  SYMRIG_MUST(code_is("start", symrig_wire_Code_CODE_OK, board.start()));
  board.session.listen_for(50ms);
  const auto now = board.status();
  if (!now) return failed("no answer to get_status");
  SYMRIG_MUST(same("state", symrig_wire_State_STATE_FAULT, raw(now->state)));
  SYMRIG_MUST(same("fault", symrig_wire_FaultCode_FAULT_INTERLOCK, raw(now->fault.code)));
  SYMRIG_MUST(same("fault arg, the line", input, now->fault.arg));
  return board.outputs_safe();
}

Verdict trips(BoardUnderTest& board) {
  return opened_by_a_run(board, board.word(), false);
}

/// A loose contact. The level alone would not show it: it is closed again when a slow board looks.
Verdict short_opening(BoardUnderTest& board) {
  const auto shortest = static_cast<std::uint32_t>(board.ticks(1us));
  return opened_by_a_run(board, std::max(board.can.min_dwell, shortest), true);
}

constexpr std::array<Check, 5> kInterlockChecks{{
    {"interlock.open_refuses", "with an open interlock the board does not arm, and changes no output",
     open_refuses},
    {"interlock.closed_allows", "with a closed interlock both are possible", closed_allows},
    {"interlock.not_an_output", "an output cannot be an interlock", not_an_output},
    {"interlock.trips", "an interlock that opens during a run makes the outputs safe (needs a jumper)",
     trips},
    {"interlock.short_opening",
     "so does one that opens for the shortest word, of 1 us or more, and closes again (needs a jumper)",
     short_opening},
}};

}  // namespace

std::span<const Check> interlock_checks() {
  return kInterlockChecks;
}

}  // namespace symrig::conformance
