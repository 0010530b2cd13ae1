// SPDX-License-Identifier: Apache-2.0
#include "symrig/boards/pin_log.hpp"

#include <vector>

#include <gtest/gtest.h>

namespace symrig::board_common::test::pin_log_test {
namespace {

constexpr hal::Tick kHold = 100;

std::vector<hal::Tick> take_all(PinLog& log, hal::Tick now) {
  std::vector<hal::Tick> ticks;
  for (hal::CapturedEdge edge; log.pop(edge, now);) ticks.push_back(edge.tick);
  return ticks;
}

TEST(PinLog, GivesEdgesInOrderOfTimeWhenNoOlderOneCanCome) {
  PinLog log(8, kHold, true);
  log.add({1000, 0, true});
  EXPECT_TRUE(take_all(log, 1099).empty());
  EXPECT_EQ(log.ready_at(), 1100U);
  log.add_input({990, 8, true});  // read later, seen earlier
  EXPECT_EQ(take_all(log, 1050), (std::vector<hal::Tick>{990}));
  EXPECT_EQ(take_all(log, 1100), (std::vector<hal::Tick>{1000}));
  EXPECT_EQ(log.ready_at(), hal::kNever);
}

TEST(PinLog, ALaterInputEdgeSettlesWhatIsOlder) {
  PinLog log(8, kHold, true);
  log.add({1000, 0, true});
  log.add_input({1001, 8, true});
  EXPECT_EQ(take_all(log, 1001), (std::vector<hal::Tick>{1000, 1001}));
}

TEST(PinLog, OfSeveralChipsNoneSettlesForTheOthers) {
  PinLog log(8, kHold, false);
  log.add_input({1001, 8, true});
  EXPECT_TRUE(take_all(log, 1050).empty());
  log.add_input({1000, 9, true});
  EXPECT_EQ(take_all(log, 1101), (std::vector<hal::Tick>{1000, 1001}));
}

TEST(PinLog, AFullLogIsAnOverflow) {
  PinLog log(2, kHold, true);
  for (hal::Tick tick = 0; tick < 3; ++tick) log.add({tick, 0, true});
  EXPECT_TRUE(log.take_overflow());
  EXPECT_FALSE(log.take_overflow());
  EXPECT_EQ(take_all(log, 1000).size(), 2U);
}

TEST(PinLog, LeavesOutLinesThatNobodyWatches) {
  PinLog log(2, kHold, true);
  log.watch(1U << 3U);
  log.add({1, 0, true});
  log.add({2, 3, true});
  EXPECT_EQ(take_all(log, 1000), (std::vector<hal::Tick>{2}));
}

TEST(PinLog, AChangeOfSeveralLinesIsAnEdgeOfEachLowestFirst) {
  PinLog log(8, 0, true);
  log.add_changes(1U << 31U | 1U << 3U | 1U, 1U << 31U | 1U << 2U, 50);
  std::vector<int> lines;
  std::vector<bool> levels;
  for (hal::CapturedEdge edge; log.pop(edge, 50);) {
    EXPECT_EQ(edge.tick, 50U);
    lines.push_back(edge.line);
    levels.push_back(edge.level);
  }
  EXPECT_EQ(lines, (std::vector<int>{0, 3, 31}));
  EXPECT_EQ(levels, (std::vector<bool>{false, false, true}));
}

TEST(PinLog, WithoutHoldAnEdgeIsThereInItsTick) {
  PinLog log(8, 0, true);
  log.add({1000, 0, true});
  EXPECT_TRUE(take_all(log, 999).empty());
  EXPECT_EQ(take_all(log, 1000), (std::vector<hal::Tick>{1000}));
}

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
}  // namespace symrig::board_common::test::pin_log_test
