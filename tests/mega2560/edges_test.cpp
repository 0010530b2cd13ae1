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
