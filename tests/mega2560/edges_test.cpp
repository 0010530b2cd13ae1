// SPDX-License-Identifier: Apache-2.0
// How exact the edges are, in cycles of the emulated processor: against the plan, with the UART busy.
#include "assert_ok.hpp"
#include "emulated_mega.hpp"
#include "symrig/board/board.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include <gtest/gtest.h>

namespace symrig::test::mega_edges_test {
namespace {

using namespace std::chrono_literals;
constexpr std::int64_t kCyclesPerTick = 8;

/// Edges of outputs, in cycles after the first.
std::vector<std::int64_t> of_outputs(const std::vector<MegaEdge>& edges) {
  std::vector<std::int64_t> cycles;
  std::uint64_t first = 0;
  for (const MegaEdge& edge : edges) {
    if (edge.line >= 6) continue;
    if (cycles.empty()) first = edge.cycle;
    cycles.push_back(static_cast<std::int64_t>(edge.cycle - first));
  }
  return cycles;
}

TEST(MegaEdges, stay_within_two_ticks_of_the_plan_while_the_host_talks) {
  NEEDS_MEGA();
  EmulatedMega mega;
  auto board = Board::connect(mega.link());
  ASSERT_OK(board);
  ASSERT_OK(board->configure({}));
  ProgramBuilder builder(board->info());
  std::vector<std::int64_t> plan;
  std::int64_t tick = 0;
  bool level = false;
  for (const int hold : {3000, 2501, 2203, 6001, 2999, 300, 7001, 2111, 4321, 301, 9000, 3333}) {
    level = !level;
    plan.push_back(tick * kCyclesPerTick);
    builder.set("camera_trigger", level).hold(Ticks{static_cast<std::uint64_t>(hold)});
    tick += hold;
  }
  const auto program = builder.end();
  ASSERT_OK(program);
  ASSERT_OK(board->upload(*program));
  ASSERT_OK(board->arm());
  mega.edges();
  ASSERT_OK(board->start());
  for (int k = 0; k < 3; ++k) ASSERT_OK(board->status());
  const auto receipt = board->wait(2s);
  ASSERT_OK(receipt);
  EXPECT_EQ(receipt->end, RunEnd::completed);
  EXPECT_EQ(receipt->late, 0U);
  const auto seen = of_outputs(mega.edges());
  ASSERT_EQ(seen.size(), plan.size());
  std::int64_t worst = 0;
  for (std::size_t k = 0; k < plan.size(); ++k) worst = std::max(worst, std::abs(seen[k] - plan[k]));
  EXPECT_LE(worst, 2 * kCyclesPerTick);
  std::printf("%zu edges, at most %lld cycles of 62.5 ns from the plan\n", seen.size(),
              static_cast<long long>(worst));
}

TEST(MegaEdges, a_word_moves_all_outputs_in_one_cycle) {
  NEEDS_MEGA();
  EmulatedMega mega;
  auto board = Board::connect(mega.link());
  ASSERT_OK(board);
  ASSERT_OK(board->configure({}));
  ProgramBuilder builder(board->info());
  for (const char* line :
       {"projector_trigger", "camera_trigger", "lamp_enable", "laser_enable", "aux0", "aux1"})
    builder.set(line, true);
  const auto program = builder.hold(5ms).end();
  ASSERT_OK(program);
  ASSERT_OK(board->upload(*program));
  mega.edges();
  ASSERT_OK(board->run(*program, 1s));
  const auto seen = of_outputs(mega.edges());
  ASSERT_EQ(seen.size(), 6U);
  EXPECT_EQ(seen.back(), 0);
}

/// The end of a run is 150 us after its last edge, which is less than a round of the main loop.
TEST(MegaEdges, the_last_edge_comes_before_the_end_of_the_run) {
  NEEDS_MEGA();
  EmulatedMega mega;
  auto board = Board::connect(mega.link());
  ASSERT_OK(board);
  ASSERT_OK(board->configure(std::vector<LineConfig>{{.line = "aux0", .capture = true}}));
  for (int k = 0; k < 40; ++k) {
    ProgramBuilder builder(board->info());
    const auto program = builder.set("aux0", true).hold(5ms + k * 61us).set("aux0", false).end();
    ASSERT_OK(program);
    const auto receipt = board->run(*program, 1s);
    ASSERT_OK(receipt);
    EXPECT_EQ(receipt->edges.size(), 2U) << "run " << k;
  }
}

}  // namespace
}  // namespace symrig::test::mega_edges_test

namespace symrig::test::mega_far_times_test {
namespace {

// Times beyond 32 bits of the clock, 35.8 minutes: the test moves the board's clock.

using namespace std::chrono_literals;
constexpr unsigned kAux0 = 4;
constexpr unsigned kVsync = 6;
constexpr std::uint64_t kCyclesPerTick = 8;
constexpr std::uint64_t kMillisecond = 16'000;  // cycles
constexpr std::uint64_t kMinute = 120'000'000;  // ticks
constexpr std::uint64_t kLap = std::uint64_t{1} << 32U;

Result<Board> ready_board(EmulatedMega& mega, Result<Program> (*make)(const BoardInfo&)) {
  SYMRIG_TRY(Board board, Board::connect(mega.link()));
  SYMRIG_CHECK(board.configure({}));
  SYMRIG_TRY(const Program program, make(board.info()));
  SYMRIG_CHECK(board.upload(program));
  SYMRIG_CHECK(board.arm_autonomous());
  return board;
}

Result<Program> pulse(const BoardInfo& info) {
  ProgramBuilder program(info);
  return program.set("aux0", true).hold(5ms).set("aux0", false).hold(1ms).end();
}

class MegaFarStarts : public testing::TestWithParam<std::uint64_t> {};

TEST_P(MegaFarStarts, begin_at_their_tick_and_not_before) {
  NEEDS_MEGA();
  EmulatedMega mega;
  auto board = ready_board(mega, pulse);
  ASSERT_OK(board);
  const auto before = board->status();
  ASSERT_OK(before);
  const std::uint64_t at = before->now.count + GetParam();
  ASSERT_OK(board->start_at(Ticks{at}));
  mega.edges();
  mega.run(100 * kMillisecond);
  EXPECT_TRUE(mega.edges().empty()) << "too early";
  ASSERT_EQ(board->status()->state, BoardState::running);
  mega.skip_time(static_cast<std::uint32_t>((GetParam() - EmulatedMega::kStep / 2) / EmulatedMega::kStep));
  const auto now = board->status();
  ASSERT_OK(now);
  const std::uint64_t cycle = mega.cycle();
  ASSERT_LT(now->now.count, at);
  mega.run((at - now->now.count + 20'000) * kCyclesPerTick);
  const auto edges = mega.edges();
  ASSERT_EQ(edges.size(), 2U);
  EXPECT_EQ(edges.front().line, kAux0);
  // The status was read some milliseconds before its answer was complete.
  const std::uint64_t planned = cycle + (at - now->now.count) * kCyclesPerTick;
  EXPECT_GE(edges.front().cycle + 20 * kMillisecond, planned);
  EXPECT_LE(edges.front().cycle, planned + kCyclesPerTick);
  EXPECT_EQ(board->status()->state, BoardState::done);
}

INSTANTIATE_TEST_SUITE_P(Mega, MegaFarStarts,
                         testing::Values(8 * kMinute, 10 * kMinute, 20 * kMinute, 30 * kMinute,
                                         kLap + 100'000, 2 * kLap + 20 * kMinute));

Result<Program> wait(const BoardInfo& info) {
  ProgramBuilder program(info);
  return program.set("aux0", true)
      .hold(1ms)
      .wait_edge("vsync", EdgeKind::rising, 5s, OnTimeout::keep_going)
      .set("aux0", false)
      .hold(1ms)
      .end();
}

/// The edge came almost 2^32 ticks before the wait begins.
TEST(MegaFarTimes, a_wait_does_not_end_on_an_edge_of_half_an_hour_ago) {
  NEEDS_MEGA();
  EmulatedMega mega;
  mega.set_input(kVsync, true);
  mega.run(kMillisecond);
  mega.set_input(kVsync, false);
  mega.run(500 * kMillisecond);
  mega.skip_time(static_cast<std::uint32_t>(kLap / EmulatedMega::kStep - 1));
  auto board = ready_board(mega, wait);
  ASSERT_OK(board);
  mega.edges();
  ASSERT_OK(board->start());
  mega.run(5'010 * kMillisecond);
  const auto edges = mega.edges();
  ASSERT_EQ(edges.size(), 2U);
  EXPECT_GE(edges.back().cycle - edges.front().cycle, 5'000 * kMillisecond) << "nothing happened at vsync";
}

}  // namespace
}  // namespace symrig::test::mega_far_times_test
