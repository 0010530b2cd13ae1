// SPDX-License-Identifier: Apache-2.0
#include "symrig/boards/pin_log.hpp"

#include <gtest/gtest.h>

namespace symrig::board_common::test::ring_test {
namespace {

TEST(Ring, GivesWhatWasPushedInOrderRoundItsEnd) {
  Ring<int> ring(3);
  int next = 0;
  for (int round = 0; round < 5; ++round) {
    EXPECT_TRUE(ring.push(2 * round));
    EXPECT_TRUE(ring.push(2 * round + 1));
    EXPECT_EQ(ring.room(), 1U);
    EXPECT_EQ(ring[1], 2 * round + 1);
    for (int value = -1; ring.pop(value); ++next) EXPECT_EQ(value, next);
  }
  EXPECT_EQ(next, 10);
}

TEST(Ring, RefusesWhatItHasNoRoomForAndKeepsTheRest) {
  Ring<int> ring(2);
  EXPECT_TRUE(ring.push(1));
  EXPECT_TRUE(ring.push(2));
  EXPECT_FALSE(ring.push(3));
  EXPECT_EQ(ring.front(), 1);
  ring.clear();
  EXPECT_TRUE(ring.empty());
  EXPECT_EQ(ring.room(), 2U);
  int value = 7;
  EXPECT_FALSE(ring.pop(value));
  EXPECT_EQ(value, 7);
}

}  // namespace
}  // namespace symrig::board_common::test::ring_test
