// SPDX-License-Identifier: Apache-2.0
// Runs of programs: marks, edges, durations and counts must agree to the tick with the host's plan of the
// records.
#include "conformance/board_under_test.hpp"
#include "conformance/plan.hpp"
#include "symrig/protocol/check_program.hpp"

#include <algorithm>
#include <array>
#include <set>

#include <fmt/format.h>

namespace symrig::conformance {
namespace {

using namespace std::chrono_literals;
using protocol::raw;
using protocol::WaitFor;

std::uint64_t started(const BoardUnderTest& board) {
  const symrig_wire_Event* event = board.session.last_event(symrig_wire_Event_run_started_tag);
  return event == nullptr ? 0 : event->body.run_started.tick;
}

Verdict marks_as_planned(const BoardUnderTest& board, const Plan& plan) {
  std::size_t k = 0;
  for (const symrig_wire_Event& event : board.session.events()) {
    if (event.which_body != symrig_wire_Event_step_mark_tag) continue;
    const symrig_wire_StepMark& mark = event.body.step_mark;
    if (k == plan.marks.size()) return failed("more marks than planned");
    SYMRIG_MUST(same(fmt::format("id of mark {}", k), plan.marks[k].id, mark.id));
    SYMRIG_MUST(same(fmt::format("ordinal of mark {}", k), k, mark.ordinal));
    SYMRIG_MUST(same(fmt::format("tick of mark {} after the start", k), plan.marks[k].tick,
                     mark.tick - started(board)));
    ++k;
  }
  return same("marks", plan.marks.size(), k);
}

Verdict ended_as_planned(const BoardUnderTest& board, const Plan& plan) {
  const symrig_wire_RunDone& done = board.done();
  SYMRIG_MUST(same("end", symrig_wire_RunEnd_RUN_END_COMPLETED, raw(done.end)));
  SYMRIG_MUST(same("steps", plan.steps, done.steps));
  SYMRIG_MUST(same("duration", plan.duration, done.duration));
  SYMRIG_MUST(same("tick of the end", started(board) + plan.duration, done.tick));
  return same("underruns", 0, done.underruns);
}

/// Edges of the outputs that the board sees, to within the resolution of its time-stamps, and as late as a
/// best-effort board says they may be. It may be later still with words that it counts as late.
Verdict edges_as_planned(const BoardUnderTest& board, const Plan& plan) {
  std::set<std::uint64_t> late;  // words, by the tick of their plan
  for (const std::uint32_t line : board.outputs()) {
    const std::uint64_t grain = board.lines[line].stamp_ticks;
    if (!board.config.lines[line].capture) continue;
    std::vector<symrig_wire_Edge> seen;
    for (const symrig_wire_Event& event : board.session.events())
      if (event.which_body == symrig_wire_Event_edge_tag && event.body.edge.line == line)
        seen.push_back(event.body.edge);
    std::size_t k = 0;
    for (const Plan::Edge& edge : plan.edges) {
      if (edge.line != line) continue;
      if (k == seen.size()) return failed(fmt::format("line {}: edge {} is missing", line, k));
      const std::uint64_t tick = started(board) + edge.tick;
      SYMRIG_MUST(same(fmt::format("line {}: level of edge {}", line, k), edge.level, seen[k].level));
      const std::uint64_t last = tick + board.can.lateness + (grain - 1);
      const bool too_late = board.best_effort() && seen[k].tick > last;
      if (too_late) late.insert(edge.tick);
      SYMRIG_MUST(within(fmt::format("line {}: tick of edge {}", line, k), tick - (grain - 1),
                         too_late ? seen[k].tick : last, seen[k].tick));
      ++k;
    }
    SYMRIG_MUST(same(fmt::format("line {}: edges", line), k, seen.size()));
  }
  return board.late_as_told(late.size());
}

void capture_outputs(BoardUnderTest& board) {
  for (const std::uint32_t line : board.outputs())
    board.config.lines[line].capture = board.lines[line].stamp_ticks != 0;
}

Verdict runs_as_planned(BoardUnderTest& board, const Bytes& program) {
  const Plan plan = plan_of(program);
  SYMRIG_MUST(board.run_to_end(program, 10s));
  SYMRIG_MUST(marks_as_planned(board, plan));
  SYMRIG_MUST(edges_as_planned(board, plan));
  SYMRIG_MUST(ended_as_planned(board, plan));
  return board.in_state(symrig_wire_State_STATE_DONE);
}

/// A program: each output alone, then all, in words of different lengths.
Bytes scale(const BoardUnderTest& board, std::uint32_t ticks) {
  Bytes program;
  std::uint32_t all = 0;
  const auto add = [&](const Bytes& part) { program.insert(program.end(), part.begin(), part.end()); };
  for (const std::uint32_t line : board.outputs()) {
    add(pack({mark(line), word(1U << line, ticks + 7 * line), word(0, ticks + line)}));
    all |= 1U << line;
  }
  add(pack({mark(99), word(all, ticks), mark(100), end()}));
  return program;
}

Verdict words(BoardUnderTest& board) {
  return runs_as_planned(board, scale(board, board.word()));
}

/// Each word of the scale makes up to one edge for each output, and a mark. A board with room for few events
/// gets the time to send them over a slow link before the next word.
std::uint32_t word_for_edges(const BoardUnderTest& board) {
  constexpr std::uint32_t kRoomForAll = 128;
  const auto slow = static_cast<std::uint32_t>(board.can.tick_hz / 20);
  return board.can.event_ring < kRoomForAll ? std::max(board.word(), slow) : board.word();
}

Verdict edges(BoardUnderTest& board) {
  if (!board.seen_output())
    return skipped("the board stamps no edges of its outputs; a jumper can show them");
  capture_outputs(board);
  return runs_as_planned(board, scale(board, word_for_edges(board)));
}

Verdict loops(BoardUnderTest& board) {
  const std::uint32_t bit = 1U << board.outputs().front();
  const std::uint32_t ticks = board.word();
  Bytes program =
      pack({mark(1), loop(3), word(bit, ticks), loop(4), mark(2), word(0, ticks + 3), end_loop(),
            word(bit, ticks + 1), end_loop(), mark(3), loop(1), word(0, ticks), end_loop(), end()});
  return runs_as_planned(board, program);
}

Verdict final_levels(BoardUnderTest& board) {
  const std::uint32_t bit = 1U << board.outputs().front();
  SYMRIG_MUST(board.run_to_end(pack({word(0, board.word()), end(bit)}), 1s));
  const auto now = board.status();
  if (!now) return failed("no answer to get_status");
  SYMRIG_MUST(same("level of the line that End leaves high", bit, now->levels & bit));
  board.abort();
  return board.outputs_safe();
}

/// The board computes the duration of 2^32 rounds without executing them.
Verdict planned(BoardUnderTest& board) {
  constexpr std::uint64_t kRounds = protocol::kMaxRounds;
  const std::uint32_t ticks = board.word();
  SYMRIG_MUST(board.load(pack({loop(kRounds), word(0, ticks), end_loop(), end()})));
  SYMRIG_MUST(same("steps", kRounds, board.committed.steps));
  SYMRIG_MUST(same("planned_min", kRounds * ticks, board.committed.planned_min));
  return same("planned_max", kRounds * ticks, board.committed.planned_max);
}

Verdict again(BoardUnderTest& board) {
  const Bytes program = scale(board, board.word());
  SYMRIG_MUST(runs_as_planned(board, program));
  for (int k = 0; k < 3; ++k) {
    SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_OK, board.arm()));
    board.session.forget();
    SYMRIG_MUST(code_is("start", symrig_wire_Code_CODE_OK, board.start()));
    SYMRIG_MUST(board.await_done(5s));
    SYMRIG_MUST(ended_as_planned(board, plan_of(program)));
    SYMRIG_MUST(board.late_as_told());
  }
  return {};
}

Verdict start_at(BoardUnderTest& board) {
  const Bytes program = scale(board, board.word());
  SYMRIG_MUST(board.load(program));
  SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_OK, board.arm()));
  board.session.forget();
  const std::uint64_t at = board.now() + board.ticks(200ms);
  SYMRIG_MUST(code_is("start at a tick", symrig_wire_Code_CODE_OK, board.start_at(at)));
  SYMRIG_MUST(board.await_done(5s));
  SYMRIG_MUST(same("tick of the start", at, started(board)));
  return marks_as_planned(board, plan_of(program));
}

Verdict start_in_past(BoardUnderTest& board) {
  SYMRIG_MUST(board.load(scale(board, board.word())));
  SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_OK, board.arm()));
  const std::uint64_t now = board.now();
  board.session.listen_for(2ms);
  SYMRIG_MUST(code_is("start at a past tick", symrig_wire_Code_CODE_IN_PAST, board.start_at(now)));
  return board.in_state(symrig_wire_State_STATE_ARMED);
}

/// Fields 3 to 7 of Start are reserved for ways to come. A board that does not know one must not start at
/// once.
Verdict start_unknown(BoardUnderTest& board) {
  struct Way {
    const char* name;
    Bytes request;  // Request { start: ... }, field 9
  };
  const std::array<Way, 3> ways{{{"start without a way", {0x4A, 0}},
                                 {"start with now = false", {0x4A, 2, 0x08, 0}},
                                 {"start in the way of field 3", {0x4A, 2, 0x18, 1}}}};
  const std::uint32_t bit = 1U << board.outputs().front();
  SYMRIG_MUST(board.load(pack({word(bit, board.word()), end(bit)})));
  SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_OK, board.arm()));
  for (const Way& way : ways) {
    const auto reply = board.session.ask_bytes(way.request);
    SYMRIG_MUST(code_is(way.name, symrig_wire_Code_CODE_BAD_VALUE, reply ? raw(reply->code) : kNoCode));
    SYMRIG_MUST(same("field", symrig_wire_Start_now_tag, reply->field));
    board.session.listen_for(kQuietTime);
    SYMRIG_MUST(board.in_state(symrig_wire_State_STATE_ARMED));
    SYMRIG_MUST(board.outputs_safe());
  }
  return {};
}

/// An input and an edge that the board can wait for. Takes the last input, because boards list busy inputs
/// first.
std::optional<std::pair<std::uint32_t, WaitFor>> awaitable(const BoardUnderTest& board) {
  std::optional<std::pair<std::uint32_t, WaitFor>> found;
  for (const std::uint32_t input : board.inputs())
    for (unsigned edge = 0; edge < 3; ++edge)
      if (((board.lines[input].waits >> edge) & 1U) != 0) found = {input, static_cast<WaitFor>(edge)};
  return found;
}

constexpr std::string_view kNoWaits = "the board cannot wait for any input";

/// Nothing is wired to the inputs, so every wait times out. The board may resume up to a millisecond later.
Verdict wait_timeout(BoardUnderTest& board) {
  const auto found = awaitable(board);
  if (!found) return skipped(std::string(kNoWaits));
  const std::uint32_t timeout = board.word() * 3;
  SYMRIG_MUST(board.run_to_end(pack({word(0, board.word()), wait(found->first, found->second, false, timeout),
                                     mark(1), word(0, board.word()), end()}),
                               1s));
  const symrig_wire_Event* mark = board.session.last_event(symrig_wire_Event_step_mark_tag);
  if (mark == nullptr) return failed("the mark after the wait is missing");
  const std::uint64_t waited = std::uint64_t{timeout} + board.can.wait_latency;
  const std::uint64_t resumed = mark->body.step_mark.tick - started(board);
  SYMRIG_MUST(within("tick of the mark after a wait that timed out", board.word() + waited,
                     board.word() + waited + board.ticks(1ms), resumed));
  SYMRIG_MUST(same("planned_min", 2 * std::uint64_t{board.word()} + board.can.wait_latency,
                   board.committed.planned_min));
  SYMRIG_MUST(same("planned_max", 2 * std::uint64_t{board.word()} + waited, board.committed.planned_max));
  return same("duration, counted from the mark", resumed + board.word(), board.done().duration);
}

Verdict wait_abort(BoardUnderTest& board) {
  const auto found = awaitable(board);
  if (!found) return skipped(std::string(kNoWaits));
  const std::uint32_t bit = 1U << board.outputs().front();
  SYMRIG_MUST(
      board.run_to_end(pack({word(bit, board.word()), wait(found->first, found->second, true, board.word()),
                             word(bit, board.word()), end(bit)}),
                       1s));
  const symrig_wire_RunDone& done = board.done();
  SYMRIG_MUST(same("end", symrig_wire_RunEnd_RUN_END_WAIT_TIMEOUT, raw(done.end)));
  SYMRIG_MUST(same("arg, the record that waited", 1, done.arg));
  const std::uint64_t shortest = 2 * std::uint64_t{board.word()};
  SYMRIG_MUST(within("duration", shortest, shortest + board.ticks(1ms), done.duration));
  SYMRIG_MUST(same("steps", 1, done.steps));
  SYMRIG_MUST(board.outputs_safe());
  return board.in_state(symrig_wire_State_STATE_LOADED);
}

/// The board's worst use of its outputs agrees with the rules.
Verdict line_use(BoardUnderTest& board) {
  const Bytes program = scale(board, board.word());
  SYMRIG_MUST(board.load(program));
  const protocol::ProgramRules rules = board.rules();
  const auto sink = [](const protocol::Violation&) { return true; };
  protocol::ProgramCheck check(rules, sink);
  while (!check.advance({{program.data(), program.size()}}, UINT32_MAX)) {
  }
  for (const std::uint32_t line : board.outputs()) {
    symrig_wire_Request request = make_request(symrig_wire_Request_program_line_tag);
    request.body.program_line.line = line;
    const auto reply = board.session.ask(request);
    SYMRIG_MUST(code_is("program_line", symrig_wire_Code_CODE_OK, reply ? raw(reply->code) : kNoCode));
    SYMRIG_MUST(same("worst_on", check.use(line).worst_on, reply->body.line_use.worst_on));
    SYMRIG_MUST(same("worst_duty_permille", check.use(line).worst_duty_permille,
                     reply->body.line_use.worst_duty_permille));
  }
  return {};
}

constexpr std::array<Check, 12> kProgramChecks{{
    {"programs.words", "marks, steps and duration are exact to the tick", words},
    {"programs.edges", "edges that the board stamps are exact to its resolution", edges},
    {"programs.loops", "nested loops", loops},
    {"programs.final_levels", "the levels of End stay after the run", final_levels},
    {"programs.planned", "the commit reports steps and duration of 2^32 rounds", planned},
    {"programs.again", "the same program runs four times", again},
    {"programs.start_at", "a start at a tick begins at that tick", start_at},
    {"programs.start_in_past", "refuses a start at a past tick", start_in_past},
    {"programs.start_unknown", "refuses a start without a way that it knows, and nothing moves",
     start_unknown},
    {"programs.wait_timeout", "a wait that times out lasts for its time-out and the wait latency",
     wait_timeout},
    {"programs.wait_abort", "a wait that times out can end the run with safe outputs", wait_abort},
    {"programs.line_use", "line_use reports the worst use of each output", line_use},
}};

}  // namespace

std::span<const Check> program_checks() {
  return kProgramChecks;
}

}  // namespace symrig::conformance
