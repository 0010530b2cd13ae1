// SPDX-License-Identifier: Apache-2.0
// Lamps and lasers: the conditions for arming, and the guard that watches the pins during a run.
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

constexpr std::string_view kUnseen = "the board stamps no edges of its outputs, so it accepts no limits";

Bytes blink(const BoardUnderTest& board) {
  return pack({word(0, board.word()), end()});
}

Verdict arm_refused(BoardUnderTest& board, std::uint32_t line, bool autonomous) {
  symrig_wire_Request request = make_request(symrig_wire_Request_arm_tag);
  request.body.arm = {board.program_hash, board.config_hash, autonomous};
  const auto reply = board.session.ask(request);
  SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_KEEP_ALIVE_NEEDED, reply ? raw(reply->code) : kNoCode));
  SYMRIG_MUST(same("detail, the line", line, reply->detail));
  return board.in_state(symrig_wire_State_STATE_LOADED);
}

Verdict lamp_needs_keep_alive(BoardUnderTest& board) {
  const std::uint32_t line = board.outputs().front();
  board.config.lines[line].hazard = symrig_wire_Hazard_HAZARD_LAMP;
  SYMRIG_MUST(board.load(blink(board)));
  SYMRIG_MUST(arm_refused(board, line, false));
  SYMRIG_MUST(code_is("keep_alive 1000", symrig_wire_Code_CODE_OK, board.keep_alive(1000)));
  return code_is("arm with a keep-alive", symrig_wire_Code_CODE_OK, board.arm());
}

Verdict lamp_not_autonomous(BoardUnderTest& board) {
  const std::uint32_t line = board.outputs().front();
  board.config.lines[line].hazard = symrig_wire_Hazard_HAZARD_LAMP;
  SYMRIG_MUST(board.load(blink(board)));
  SYMRIG_MUST(code_is("keep_alive 1000", symrig_wire_Code_CODE_OK, board.keep_alive(1000)));
  return arm_refused(board, line, true);
}

Verdict laser_needs_max_on(BoardUnderTest& board) {
  const std::uint32_t line = board.outputs().front();
  board.config.lines[line].hazard = symrig_wire_Hazard_HAZARD_LASER;
  return code_is("a laser without max_on", symrig_wire_Code_CODE_BAD_VALUE, board.config_line(line));
}

Verdict laser_needs_short_keep_alive(BoardUnderTest& board) {
  const auto line = board.seen_output();
  if (!line) return skipped(std::string(kUnseen));
  board.config.lines[*line].hazard = symrig_wire_Hazard_HAZARD_LASER;
  board.config.lines[*line].max_on = board.word();
  SYMRIG_MUST(board.load(blink(board)));
  SYMRIG_MUST(code_is("keep_alive 501", symrig_wire_Code_CODE_OK, board.keep_alive(501)));
  SYMRIG_MUST(arm_refused(board, *line, false));
  SYMRIG_MUST(code_is("keep_alive 500", symrig_wire_Code_CODE_OK, board.keep_alive(500)));
  return code_is("arm with a keep-alive of 500 ms", symrig_wire_Code_CODE_OK, board.arm());
}

Verdict keep_alive_stays_on(BoardUnderTest& board) {
  board.config.lines[board.outputs().front()].hazard = symrig_wire_Hazard_HAZARD_LAMP;
  SYMRIG_MUST(board.load(blink(board)));
  SYMRIG_MUST(code_is("keep_alive 1000", symrig_wire_Code_CODE_OK, board.keep_alive(1000)));
  SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_OK, board.arm()));
  SYMRIG_MUST(code_is("keep_alive 0 while armed with a lamp", symrig_wire_Code_CODE_KEEP_ALIVE_NEEDED,
                      board.keep_alive(0)));
  return board.in_state(symrig_wire_State_STATE_ARMED);
}

Verdict bad_numbers(BoardUnderTest& board) {
  const std::uint32_t line = board.outputs().front();
  board.config.lines[line].max_duty_permille = 1001;
  SYMRIG_MUST(code_is("a duty of 1001 permille", symrig_wire_Code_CODE_BAD_VALUE, board.config_line(line)));
  board.config.lines[line].max_duty_permille = 0;
  board.config.lines[line].max_on = protocol::kMaxDuration + 1;
  SYMRIG_MUST(code_is("max_on beyond 2^50", symrig_wire_Code_CODE_BAD_VALUE, board.config_line(line)));
  return code_is("keep_alive 60001", symrig_wire_Code_CODE_BAD_VALUE, board.keep_alive(60'001));
}

/// Turns a line with a max_on on by hand.
Verdict hold_by_hand(BoardUnderTest& board, std::uint32_t line, std::uint64_t max_on, std::uint64_t min_off) {
  board.config.lines[line].max_on = max_on;
  board.config.lines[line].min_off = min_off;
  SYMRIG_MUST(board.configure());
  return code_is("manual_set", symrig_wire_Code_CODE_OK, board.manual_set(1U << line, 1U << line));
}

/// Only the guard can turn a line off that was turned on by hand. It must do so within 10 ms of the limit.
Verdict guard_max_on(BoardUnderTest& board) {
  const auto line = board.seen_output();
  if (!line) return skipped(std::string(kUnseen));
  const std::uint64_t limit = board.ticks(20ms);
  const std::uint64_t before = board.now();
  SYMRIG_MUST(hold_by_hand(board, *line, limit, 0));
  const std::uint64_t after = board.now();
  board.session.listen_for(50ms);
  const auto now = board.status();
  if (!now) return failed("no answer to get_status");
  SYMRIG_MUST(same("state", symrig_wire_State_STATE_FAULT, raw(now->state)));
  SYMRIG_MUST(same("fault", symrig_wire_FaultCode_FAULT_MAX_ON, raw(now->fault.code)));
  SYMRIG_MUST(same("fault arg, the line", *line, now->fault.arg));
  SYMRIG_MUST(
      within("tick of the fault", before + limit, after + limit + board.ticks(10ms), now->fault.tick));
  return board.outputs_safe();
}

/// A line that was on must rest.
Verdict cooling(BoardUnderTest& board) {
  const auto line = board.seen_output();
  if (!line) return skipped(std::string(kUnseen));
  board.session.listen_for(500ms);  // it may still have to rest after the last check
  SYMRIG_MUST(hold_by_hand(board, *line, 0, board.ticks(400ms)));
  SYMRIG_MUST(code_is("manual_set off", symrig_wire_Code_CODE_OK, board.manual_set(1U << *line, 0)));
  board.session.listen_for(5ms);
  SYMRIG_MUST(code_is("manual_set on again before the rest is over", symrig_wire_Code_CODE_COOLING,
                      board.manual_set(1U << *line, 1U << *line)));
  SYMRIG_MUST(board.upload(blink(board)));
  SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_OK, board.arm()));
  SYMRIG_MUST(code_is("start before the rest is over", symrig_wire_Code_CODE_COOLING, board.start()));
  board.session.listen_for(500ms);
  return code_is("start after the rest", symrig_wire_Code_CODE_OK, board.start());
}

std::uint32_t output_mask(const BoardUnderTest& board) {
  std::uint32_t mask = 0;
  for (const std::uint32_t line : board.outputs()) mask |= 1U << line;
  return mask;
}

Verdict each_by_hand(BoardUnderTest& board) {
  SYMRIG_MUST(board.configure());
  std::uint32_t all = 0;
  for (const std::uint32_t line : board.outputs()) {
    all |= 1U << line;
    SYMRIG_MUST(code_is("manual_set", symrig_wire_Code_CODE_OK, board.manual_set(1U << line, 1U << line)));
    const auto now = board.status();
    if (!now) return failed("no answer to get_status");
    SYMRIG_MUST(same("levels of the outputs", all, now->levels & output_mask(board)));
  }
  board.abort();
  return board.outputs_safe();
}

Verdict by_hand_wrong_line(BoardUnderTest& board) {
  if (board.inputs().empty()) return skipped("the board has no inputs");
  SYMRIG_MUST(board.configure());
  const std::uint32_t line = board.inputs().front();
  return code_is("manual_set of an input", symrig_wire_Code_CODE_WRONG_DIRECTION,
                 board.manual_set(1U << line, 0));
}

/// Safe levels may be high.
Verdict safe_high(BoardUnderTest& board) {
  const std::uint32_t line = board.outputs().back();
  board.config.lines[line].safe_level = true;
  SYMRIG_MUST(board.configure());
  SYMRIG_MUST(board.outputs_safe());
  SYMRIG_MUST(board.upload(blink(board)));
  SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_OK, board.arm()));
  SYMRIG_MUST(code_is("start", symrig_wire_Code_CODE_OK, board.start()));
  SYMRIG_MUST(board.await_done(1s));
  board.abort();
  return board.outputs_safe();
}

Verdict run_is_cut(BoardUnderTest& board) {
  const std::uint32_t all = output_mask(board);
  SYMRIG_MUST(board.load(pack({loop(1'000'000), word(all, board.word()), end_loop(), end(all)})));
  SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_OK, board.arm()));
  SYMRIG_MUST(code_is("start", symrig_wire_Code_CODE_OK, board.start()));
  const auto before = board.status();
  if (!before) return failed("no answer to get_status");
  SYMRIG_MUST(same("levels of the outputs during the run", all, before->levels & all));
  board.abort();
  SYMRIG_MUST(board.outputs_safe());
  SYMRIG_MUST(board.await_done(1s));
  return same("end", symrig_wire_RunEnd_RUN_END_ABORTED, raw(board.done().end));
}

constexpr std::array<Check, 12> kLimitChecks{{
    {"limits.lamp_needs_keep_alive", "the board arms a lamp only with a keep-alive", lamp_needs_keep_alive},
    {"limits.lamp_not_autonomous", "the board does not arm a lamp for an autonomous run",
     lamp_not_autonomous},
    {"limits.laser_needs_max_on", "a laser needs a max_on", laser_needs_max_on},
    {"limits.laser_needs_short_keep_alive", "a laser needs a keep-alive of at most 500 ms",
     laser_needs_short_keep_alive},
    {"limits.keep_alive_stays_on", "the keep-alive cannot be turned off while a lamp is armed",
     keep_alive_stays_on},
    {"limits.bad_numbers", "the board refuses limits out of range", bad_numbers},
    {"limits.guard_max_on", "the board turns off a line within 10 ms of its max_on", guard_max_on},
    {"limits.cooling", "the board does not turn on a line that must rest", cooling},
    {"limits.by_hand", "levels set by hand, one output after the other", each_by_hand},
    {"limits.by_hand_wrong_line", "refuses levels set by hand on inputs", by_hand_wrong_line},
    {"limits.safe_high", "a safe level may be high", safe_high},
    {"limits.run_is_cut", "an abort amid a run makes safe at once", run_is_cut},
}};

}  // namespace

std::span<const Check> limit_checks() {
  return kLimitChecks;
}

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
