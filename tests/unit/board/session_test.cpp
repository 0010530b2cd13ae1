// SPDX-License-Identifier: Apache-2.0

#include "bench.hpp"
#include "symrig/board/board.hpp"
#include "symrig/program/compile.hpp"
#include "symrig/run/frame_ledger.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::session_test {
namespace {

using namespace std::chrono_literals;
using test::Bench;

Program lamp_for(const Board& board, Nanoseconds on) {
  ProgramBuilder builder(board.info());
  return *builder.pulse("lamp_enable", on).hold(1ms).end();
}

/// So many photographs of one bracket, on the usual lines.
Program bracket_program(const BoardInfo& info, const std::vector<Nanoseconds>& exposures,
                        std::size_t photographs) {
  const std::vector<std::vector<Nanoseconds>> brackets(photographs, exposures);
  auto compiled = compile_brackets(default_rig_setup(), info, brackets);
  EXPECT_TRUE(compiled.ok()) << (compiled.ok() ? "" : compiled.error().line());
  return std::move(compiled).value().program;
}

TEST(Board, learns_who_is_at_the_other_end) {
  Bench bench;
  const Board board = bench.connect();
  const BoardInfo& info = board.info();
  EXPECT_EQ(info.board, "sim");
  EXPECT_EQ(info.unique_id, "73696d2d30303031");
  EXPECT_EQ(info.rate.hz, 125'000'000U);
  EXPECT_EQ(info.lines.size(), 6U);
  EXPECT_EQ(info.line("vsync"), 3);
  EXPECT_EQ(info.line("nothing"), -1);
  EXPECT_NE(info.firmware_hash, 0U);
}

TEST(Board, a_capture_of_800_photographs_of_4_exposures) {
  Bench bench;
  Board board = bench.connect();
  const std::vector<LineConfig> lines{{.line = "camera_strobe", .capture = true}};
  ASSERT_OK(board.configure(lines));
  const std::vector<Nanoseconds> exposures{100us, 800us, 6400us, 51200us};
  const auto receipt = board.run(bracket_program(board.info(), exposures, 800), 3600s);
  ASSERT_OK(receipt);
  EXPECT_TRUE(receipt->clean());
  EXPECT_EQ(receipt->marks.size(), 800U * 5U);
  EXPECT_EQ(receipt->edges.size(), 800U * 8U);
  EXPECT_EQ(bench.camera.frames().size(), 3200U);
  EXPECT_EQ(bench.camera.missed_triggers(), 0);
  EXPECT_EQ(bench.projector.changes().size(), 800U);
  // Words: pulse, rest before the wait, settle, and two for each exposure; no wait ran out.
  EXPECT_EQ(receipt->steps, 800U * (3U + 2U * 4U));
  EXPECT_GE(receipt->actual, receipt->planned_min);
  EXPECT_LE(receipt->actual, receipt->planned_max);
  // Settle, exposures and readouts take 75.5 ms, the pulse 0.1 ms: each photograph spans five refreshes,
  // which end it within one refresh of the sum.
  const double photograph = seconds(receipt->duration()) / 800;
  EXPECT_GT(photograph, 0.0756);
  EXPECT_LT(photograph, 0.0756 + 1.0 / 60);

  const auto ledger =
      FrameLedger::pair(receipt->marks, frames_from_strobe(*receipt, board.info().line("camera_strobe")),
                        board.info().rate.ticks(10us));
  ASSERT_OK(ledger);
  EXPECT_TRUE(ledger->complete()) << ledger->summary();
  for (const LedgerEntry& entry : ledger->entries()) {
    const auto& frame = bench.camera.frames()[*entry.frame];
    EXPECT_EQ(bench.projector.pattern_at(frame.begin), entry.photograph);
    EXPECT_EQ(frame.end - frame.begin, board.info().rate.ticks(exposures[entry.exposure]).count);
  }
}

TEST(Board, the_same_run_gives_the_same_receipt) {
  const auto run = [] {
    Bench bench;
    Board board = bench.connect();
    EXPECT_TRUE(board.configure({}).ok());
    const std::vector<Nanoseconds> exposures{1ms, 2ms};
    return *board.run(bracket_program(board.info(), exposures, 20), 60s);
  };
  const Receipt first = run();
  const Receipt second = run();
  EXPECT_EQ(first.marks, second.marks);
  EXPECT_EQ(first.actual, second.actual);
  EXPECT_EQ(first.program_hash, second.program_hash);
}

TEST(Board, a_program_that_is_there_already_is_not_sent_again) {
  Bench bench;
  Board board = bench.connect();
  ASSERT_OK(board.configure({}));
  const Program program = lamp_for(board, 5ms);
  ASSERT_OK(board.run(program, 1s));
  EXPECT_EQ(board.status()->state, BoardState::done);
  ASSERT_OK(board.upload(program));
  EXPECT_EQ(board.status()->state, BoardState::done);  // begin would have made it CONFIGURED
  const auto again = board.run(program, 1s);
  ASSERT_OK(again);
  EXPECT_TRUE(again->clean());
  ASSERT_OK(board.upload(lamp_for(board, 6ms)));
  EXPECT_EQ(board.status()->state, BoardState::loaded);
}

TEST(Board, long_runs_are_kept_alive) {
  Bench bench;
  Board board = bench.connect({.keep_alive = 200ms});
  const std::vector<LineConfig> lines{{.line = "lamp_enable", .hazard = Hazard::lamp}};
  ASSERT_OK(board.configure(lines));
  const auto receipt = board.run(lamp_for(board, 5s), 10s);
  ASSERT_OK(receipt);
  EXPECT_TRUE(receipt->clean());
  EXPECT_EQ(receipt->duration(), 5001ms);
}

TEST(Board, a_host_that_falls_silent_finds_a_latched_fault) {
  Bench bench;
  Board board = bench.connect({.keep_alive = 200ms});
  const std::vector<LineConfig> lines{{.line = "lamp_enable", .hazard = Hazard::lamp}};
  ASSERT_OK(board.configure(lines));
  ASSERT_OK(board.upload(lamp_for(board, 5s)));
  ASSERT_OK(board.arm());
  ASSERT_OK(board.start());
  bench.sim.advance_to(bench.sim.now() + 125'000'000);  // one second of nothing
  const auto receipt = board.wait(10s);
  ASSERT_OK(receipt);
  EXPECT_EQ(receipt->end, RunEnd::fault);
  ASSERT_TRUE(receipt->fault.has_value());
  EXPECT_EQ(receipt->fault->name, "keep_alive");
  EXPECT_EQ(receipt->duration(), 200ms);
  const auto refused = board.arm();
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().what.find("fault"), std::string::npos);
  ASSERT_OK(board.clear_fault());
  ASSERT_OK(board.configure(lines));
  EXPECT_EQ(board.status()->state, BoardState::configured);
}

TEST(Board, lamps_are_not_armed_without_keep_alive) {
  Bench bench;
  Board board = bench.connect({.keep_alive = 0ns});
  const std::vector<LineConfig> lines{{.line = "lamp_enable", .hazard = Hazard::lamp}};
  ASSERT_OK(board.configure(lines));
  ASSERT_OK(board.upload(lamp_for(board, 5ms)));
  const auto armed = board.arm();
  ASSERT_FALSE(armed.ok());
  EXPECT_EQ(armed.error().line(),
            "the board refused to arm: keep_alive_needed, line 'lamp_enable'; lamp and laser lines need a "
            "keep-alive (a laser one of at most 500 ms): set BoardOptions::keep_alive");
}

TEST(Board, abort_ends_a_run_at_once) {
  Bench bench;
  Board board = bench.connect();
  ASSERT_OK(board.configure({}));
  ASSERT_OK(board.upload(lamp_for(board, 5s)));
  ASSERT_OK(board.arm());
  ASSERT_OK(board.start());
  EXPECT_FALSE(board.wait(100ms).ok());  // it goes on
  EXPECT_NE(bench.sim.levels() & 4U, 0U);
  ASSERT_OK(board.abort());
  EXPECT_EQ(bench.sim.levels() & 4U, 0U);
  const auto receipt = board.wait(1s);
  ASSERT_OK(receipt);
  EXPECT_EQ(receipt->end, RunEnd::aborted);
  EXPECT_EQ(receipt->duration(), 100ms);
}

TEST(Board, starts_at_a_tick) {
  Bench bench;
  Board board = bench.connect();
  ASSERT_OK(board.configure({}));
  ASSERT_OK(board.upload(lamp_for(board, 5ms)));
  ASSERT_OK(board.arm());
  const Ticks at = board.status()->now + Ticks{1'234'567};
  ASSERT_OK(board.start_at(at));
  const auto receipt = board.wait(1s);
  ASSERT_OK(receipt);
  EXPECT_EQ(receipt->started, at);
}

TEST(Board, tells_the_time) {
  Bench bench;
  Board board = bench.connect();
  bench.sim.advance_to(1'250'000);
  const auto reading = board.time();
  ASSERT_OK(reading);
  EXPECT_EQ(reading->taken.since.count, 1'250'000U);
  EXPECT_EQ(reading->answered, reading->taken);
  EXPECT_EQ(reading->sent.since, 10ms);
  EXPECT_EQ(reading->received.since, 10ms);
}

TEST(Board, marks_are_told_as_they_come) {
  Bench bench;
  Board board = bench.connect();
  ASSERT_OK(board.configure({}));
  std::vector<std::uint32_t> ids;
  board.on_mark([&](const StepMark& mark) { ids.push_back(mark.id); });
  const std::vector<Nanoseconds> exposures{1ms, 2ms};
  ASSERT_OK(board.run(bracket_program(board.info(), exposures, 2), 60s));
  const std::vector<std::uint32_t> expected{0, 1, 2, 0, 1, 2};
  EXPECT_EQ(ids, expected);
}

TEST(Board, a_line_that_does_not_exist_is_named) {
  Bench bench;
  Board board = bench.connect();
  const std::vector<LineConfig> lines{{.line = "laser"}};
  const auto result = board.configure(lines);
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::unknown_name);
  EXPECT_EQ(result.error().line(),
            "the board has no line 'laser'; outputs: projector_trigger, camera_trigger, lamp_enable; "
            "inputs: vsync, camera_strobe, interlock");
}

TEST(Board, a_board_that_restarted_is_noticed) {
  Bench bench;
  Board board = bench.connect();
  bench.sim.reboot();
  const auto status = board.status();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::device_lost);
  EXPECT_NE(status.error().what.find("restarted"), std::string::npos);
}

TEST(Board, a_board_that_is_not_there_is_given_up) {
  Bench bench;
  bench.sim.set_attached(false);
  const auto board = Board::connect(make_sim_link(bench.sim));
  ASSERT_FALSE(board.ok());
  EXPECT_EQ(board.error().code, ErrorCode::device_lost);
}

TEST(Board, a_second_session_finds_the_board_as_it_is) {
  Bench bench;
  Board first = bench.connect();
  ASSERT_OK(first.configure({}));
  ASSERT_OK(first.upload(lamp_for(first, 5ms)));
  Board second = bench.connect();
  const auto status = second.status();
  ASSERT_OK(status);
  EXPECT_EQ(status->state, BoardState::loaded);
  EXPECT_EQ(status->program_hash, lamp_for(second, 5ms).hash());
  EXPECT_FALSE(first.status().ok());  // there is one session at a time
}

}  // namespace
}  // namespace symrig::session_test

// What a board has measured about itself, against what it declares.

namespace symrig::diagnostics_test {
namespace {

BoardInfo declared() {
  BoardInfo info;
  info.board = "pico";
  info.poll_ticks = 240'000;
  info.refill_ticks = 450;
  return info;
}

BoardDiagnostics sound() {
  BoardDiagnostics found;
  found.longest_round = 240'000;
  found.worst_refill = 450;
  found.chip_revision = 2;
  return found;
}

TEST(Diagnostics, a_board_within_its_promises_has_no_objections) {
  EXPECT_TRUE(sound().objections(declared()).empty());
  EXPECT_TRUE(BoardDiagnostics().objections(declared()).empty()) << "nothing measured yet";
}

TEST(Diagnostics, each_broken_promise_is_named_with_both_numbers) {
  BoardDiagnostics found = sound();
  found.longest_round = 240'001;
  found.worst_refill = 451;
  found.queue_overflows = 3;
  found.dma_errors = 1;
  const auto objections = found.objections(declared());
  ASSERT_EQ(objections.size(), 4U);
  EXPECT_NE(objections[0].find("240001"), std::string::npos);
  EXPECT_NE(objections[0].find("240000"), std::string::npos);
  EXPECT_NE(objections[1].find("451"), std::string::npos);
  EXPECT_NE(objections[2].find("3 words"), std::string::npos);
  EXPECT_NE(objections[3].find("DMA"), std::string::npos);
}

TEST(Diagnostics, only_a_pico_with_a_chip_older_than_b2_is_warned_of_e5) {
  BoardDiagnostics found = sound();
  found.chip_revision = 1;
  ASSERT_EQ(found.objections(declared()).size(), 1U);
  EXPECT_NE(found.objections(declared())[0].find("RP2040-E5"), std::string::npos);
  BoardInfo other = declared();
  other.board = "other";
  EXPECT_TRUE(found.objections(other).empty());
}

}  // namespace
}  // namespace symrig::diagnostics_test
