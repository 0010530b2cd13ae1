// SPDX-License-Identifier: Apache-2.0
// The evidence that a run leaves: hashes, counters and its end.
// The board's clock, as the host reads it.
// With a wire from an output to an input, the board stamps its own output edges.
#include "conformance/board_under_test.hpp"
#include "conformance/plan.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include <fmt/format.h>

namespace symrig::conformance {
namespace {

using namespace std::chrono_literals;
using protocol::raw;

Bytes two_words(const BoardUnderTest& board) {
  return pack({word(1U << board.outputs().front(), board.word()), word(0, board.word()), end()});
}

Verdict hashes(BoardUnderTest& board) {
  SYMRIG_MUST(board.run_to_end(two_words(board), 1s));
  SYMRIG_MUST(same("program_hash of the commit", board.program_hash, board.committed.program_hash));
  const symrig_wire_Event* begun = board.session.last_event(symrig_wire_Event_run_started_tag);
  if (begun == nullptr) return failed("run_started is missing");
  SYMRIG_MUST(same("program_hash of run_started", board.program_hash, begun->body.run_started.program_hash));
  const auto now = board.status();
  if (!now) return failed("no answer to get_status");
  SYMRIG_MUST(same("program_hash of the status", board.program_hash, now->program_hash));
  return same("config_hash of the status", board.config_hash, now->config_hash);
}

Verdict counters(BoardUnderTest& board) {
  SYMRIG_MUST(board.run_to_end(two_words(board), 1s));
  const symrig_wire_RunDone& done = board.done();
  SYMRIG_MUST(same("steps of the commit", 2, board.committed.steps));
  SYMRIG_MUST(same("planned_min", 2 * std::uint64_t{board.word()}, board.committed.planned_min));
  SYMRIG_MUST(same("planned_max", 2 * std::uint64_t{board.word()}, board.committed.planned_max));
  SYMRIG_MUST(same("end", symrig_wire_RunEnd_RUN_END_COMPLETED, raw(done.end)));
  SYMRIG_MUST(same("steps", 2, done.steps));
  SYMRIG_MUST(same("duration", 2 * std::uint64_t{board.word()}, done.duration));
  SYMRIG_MUST(same("underruns", 0, done.underruns));
  SYMRIG_MUST(board.late_as_told());
  SYMRIG_MUST(same("events_lost", 0, done.events_lost));
  const auto now = board.status();
  return now ? same("steps of the status", 2, now->steps) : failed("no answer to get_status");
}

/// The progress of an aborted run.
Verdict aborted(BoardUnderTest& board) {
  SYMRIG_MUST(board.load(pack({loop(1'000'000), word(0, board.word()), end_loop(), end()})));
  SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_OK, board.arm()));
  board.session.forget();
  SYMRIG_MUST(code_is("start", symrig_wire_Code_CODE_OK, board.start()));
  board.session.listen_for(20ms);
  const std::uint64_t before = board.now();
  board.abort();
  const std::uint64_t after = board.now();
  SYMRIG_MUST(board.await_done(1s));
  const symrig_wire_RunDone& done = board.done();
  SYMRIG_MUST(same("end", symrig_wire_RunEnd_RUN_END_ABORTED, raw(done.end)));
  SYMRIG_MUST(within("tick of the end", before, after, done.tick));
  // The word that was cut short is counted. Where software makes the edges, some may not have gone out yet.
  const std::uint64_t planned = done.duration / board.word();
  return within("steps", board.best_effort() ? 1 : planned, planned + 1, done.steps);
}

Verdict bad_frames(BoardUnderTest& board) {
  const auto before = board.status();
  board.session.send_bytes(Bytes{3, 1, 1, 0});
  const auto after = board.status();
  if (!before || !after) return failed("no answer to get_status");
  return same("bad_frames after one bad frame", before->bad_frames + 1, after->bad_frames);
}

constexpr std::array<Check, 4> kReceiptChecks{{
    {"receipt.hashes", "hashes identify program and configuration", hashes},
    {"receipt.counters", "plan, steps, duration and faults of a clean run", counters},
    {"receipt.aborted", "duration and steps of an aborted run", aborted},
    {"receipt.bad_frames", "the board counts frames that it drops", bad_frames},
}};

}  // namespace

std::span<const Check> receipt_checks() {
  return kReceiptChecks;
}

namespace {

using namespace std::chrono_literals;

Verdict monotone(BoardUnderTest& board) {
  std::uint64_t last = 0;
  for (int k = 0; k < 100; ++k) {
    const auto answer = board.time();
    if (!answer) return failed("no answer to time_ping");
    SYMRIG_MUST(
        that(last <= answer->rx_tick && answer->rx_tick <= answer->tx_tick, "the clock never goes back"));
    last = answer->tx_tick;
  }
  return {};
}

Verdict echo(BoardUnderTest& board) {
  for (const std::uint64_t number : {std::uint64_t{0}, std::uint64_t{1} << 63U, UINT64_MAX}) {
    symrig_wire_Request request = make_request(symrig_wire_Request_time_ping_tag);
    request.body.time_ping.host_ns = number;
    const auto reply = board.session.ask(request);
    if (!reply || reply->which_body != symrig_wire_Reply_time_tag) return failed("no answer to time_ping");
    SYMRIG_MUST(same("host_ns", number, reply->body.time.host_ns));
  }
  return {};
}

struct Reading {
  Nanoseconds sent, received;
  std::uint64_t tick = 0;
};

bool read(BoardUnderTest& board, Reading& reading) {
  reading.sent = board.session.now();
  const auto answer = board.time();
  reading.received = board.session.now();
  reading.tick = answer ? answer->rx_tick : 0;
  return answer.has_value();
}

/// Compares the tick rate over half a second with the board's capabilities. Allows 500 ppm (two poor
/// crystals) and the uncertainty of the two readings.
Verdict rate(BoardUnderTest& board) {
  Reading first;
  Reading second;
  if (!read(board, first)) return failed("no answer to time_ping");
  board.session.listen_for(500ms);
  if (!read(board, second)) return failed("no answer to time_ping");
  const Nanoseconds shortest = second.sent - first.received;
  const Nanoseconds longest = second.received - first.sent;
  const std::uint64_t low = board.ticks(shortest - shortest / 2000);
  const std::uint64_t high = board.ticks(longest + longest / 2000) + 1;
  return within("ticks in half a second", low, high, second.tick - first.tick);
}

Verdict agrees_with_status(BoardUnderTest& board) {
  const std::uint64_t before = board.now();
  const auto now = board.status();
  const std::uint64_t after = board.now();
  if (!now) return failed("no answer to get_status");
  return within("tick of the status", before, after, now->tick);
}

constexpr std::array<Check, 4> kClockChecks{{
    {"clock.monotone", "the clock never goes back", monotone},
    {"clock.echo", "returns the host's number unchanged", echo},
    {"clock.rate", "runs at its stated rate, within 500 ppm", rate},
    {"clock.agrees_with_status", "time_ping and get_status use the same clock", agrees_with_status},
}};

}  // namespace

std::span<const Check> clock_checks() {
  return kClockChecks;
}

namespace {

using namespace std::chrono_literals;

constexpr std::string_view kNeeds = "needs a jumper from an output to an input";

Bytes pulses(const BoardUnderTest& board, std::uint32_t output) {
  const std::uint32_t bit = 1U << output;
  return pack({word(0, board.word()), loop(100), word(bit, board.word()), word(0, board.word() + 1),
               end_loop(), word(bit, 2 * board.word()), end()});
}

/// Edges by hardware come back late by the same few ticks: the resolution of the time-stamps, and 1 us at
/// most for pads and synchronisers.
Verdict constant_delay(const BoardUnderTest& board, const std::vector<std::uint64_t>& delays,
                       std::uint64_t grain) {
  for (std::size_t k = 0; k < delays.size(); ++k) {
    SYMRIG_MUST(within(fmt::format("ticks from edge {} to its time-stamp", k), 0, board.ticks(1us) + grain,
                       delays[k]));
    SYMRIG_MUST(within(fmt::format("jitter of edge {}, offset by the resolution", k), 0, 2 * (grain - 1),
                       delays[k] + (grain - 1) - delays.front()));
  }
  return {};
}

/// Edges by software: each may be late as the board says, or it is of a word that the board counts as late.
/// One that comes after the end of its word would be an underrun.
Verdict delay_as_told(const BoardUnderTest& board, const std::vector<std::uint64_t>& delays,
                      std::uint64_t grain) {
  const std::uint64_t least = delays.empty() ? 0 : *std::min_element(delays.begin(), delays.end());
  const std::uint64_t in_time =
      board.can.lateness + std::min(board.ticks(1us) + grain, least + 2 * (grain - 1));
  std::size_t late = 0;
  for (std::size_t k = 0; k < delays.size(); ++k) {
    SYMRIG_MUST(within(fmt::format("ticks from edge {} to its time-stamp", k), 0,
                       2 * std::uint64_t{board.word()}, delays[k]));
    if (delays[k] > in_time) ++late;  // every edge of the plan is a word
  }
  return board.late_as_told(late);
}

/// Each edge of the plan comes back.
Verdict stamps(BoardUnderTest& board) {
  if (!board.jumper) return skipped(std::string(kNeeds));
  const auto [output, input] = *board.jumper;
  const std::uint64_t grain = board.lines[input].stamp_ticks;
  board.config.lines[input].capture = true;
  const Bytes program = pulses(board, output);
  SYMRIG_MUST(board.run_to_end(program, 2s));
  board.session.listen_for(kQuietTime);
  const symrig_wire_Event* begun = board.session.last_event(symrig_wire_Event_run_started_tag);
  if (begun == nullptr) return failed("run_started is missing");
  const Plan plan = plan_of(program);
  std::vector<std::uint64_t> delays;
  for (const symrig_wire_Event& event : board.session.events()) {
    if (event.which_body != symrig_wire_Event_edge_tag || event.body.edge.line != input) continue;
    const std::size_t k = delays.size();
    if (k == plan.edges.size()) return failed("more edges came back than went out");
    SYMRIG_MUST(same(fmt::format("level of edge {}", k), plan.edges[k].level, event.body.edge.level));
    delays.push_back(event.body.edge.tick - (begun->body.run_started.tick + plan.edges[k].tick));
  }
  SYMRIG_MUST(board.best_effort() ? delay_as_told(board, delays, grain)
                                  : constant_delay(board, delays, grain));
  return same("edges that came back", plan.edges.size(), delays.size());
}

/// Levels that are set by hand must appear at the input.
Verdict levels(BoardUnderTest& board) {
  if (!board.jumper) return skipped(std::string(kNeeds));
  const auto [output, input] = *board.jumper;
  SYMRIG_MUST(board.configure());
  for (const std::uint32_t level : {1U, 0U, 1U}) {
    SYMRIG_MUST(
        code_is("manual_set", symrig_wire_Code_CODE_OK, board.manual_set(1U << output, level << output)));
    const auto now = board.status();
    if (!now) return failed("no answer to get_status");
    SYMRIG_MUST(same("level at the jumper's input", level, (now->levels >> input) & 1U));
  }
  return {};
}

constexpr std::array<Check, 2> kJumperChecks{{
    {"jumper.levels", "an input follows the output that is wired to it", levels},
    {"jumper.stamps", "every edge comes back, at a constant delay", stamps},
}};

}  // namespace

std::span<const Check> jumper_checks() {
  return kJumperChecks;
}

}  // namespace symrig::conformance
