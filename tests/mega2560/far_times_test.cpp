// SPDX-License-Identifier: Apache-2.0
// Times beyond 32 bits of the clock, 35.8 minutes: the test moves the board's clock.
#include "assert_ok.hpp"
#include "emulated_mega.hpp"
#include "symrig/board/board.hpp"

#include <gtest/gtest.h>

namespace symrig::test::mega_far_times_test {
namespace {

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
