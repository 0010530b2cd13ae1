// SPDX-License-Identifier: Apache-2.0
// The evidence that a run leaves: hashes, counters and its end.
#include "conformance/board_under_test.hpp"
#include "conformance/plan.hpp"

#include <array>

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

}  // namespace symrig::conformance
