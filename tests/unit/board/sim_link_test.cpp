// SPDX-License-Identifier: Apache-2.0
#include "symrig/board/link.hpp"
#include "symrig/boards/sim_board.hpp"

#include <gtest/gtest.h>

namespace symrig::sim_link_test {
namespace {

TEST(SimLink, waits_no_shorter_than_asked) {
  board_sim::SimBoardConfig config;
  config.tick_hz = 1'000'000;
  board_sim::SimBoard board(config);
  const auto link = make_sim_link(board);
  for (const std::int64_t wait : {1, 333, 499, 1000, 1499, 2'000'001}) {
    const Nanoseconds before = link->now();
    ASSERT_TRUE(link->receive(Nanoseconds(wait)).ok());
    EXPECT_GE((link->now() - before).count(), wait);
    EXPECT_LE((link->now() - before).count(), wait + 1000);  // one tick
  }
}

}  // namespace
}  // namespace symrig::sim_link_test
