// SPDX-License-Identifier: Apache-2.0
// The engine's rules, tick by tick, with a clock that the test moves.
#include "symrig/boards/playback.hpp"

#include <functional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::board_common::test::playback_test {
namespace {

using hal::Until;

constexpr std::uint32_t kSafe = 0x80;
constexpr std::uint8_t kInput = 8;
constexpr Promise kPromise{.min_dwell = 100, .lateness = 20, .wait_latency = 50, .input = 30};

class PlaybackTest : public testing::Test, public WordSink {
 protected:
  PlaybackTest() { playback_.set_safe(kSafe); }

  hal::Tick put(std::uint32_t levels) override {
    words_.emplace_back(now_, levels);
    return now_;
  }
  hal::Tick put_all(std::uint32_t levels) override { return put(levels); }

  /// Acts at every moment that is due up to `tick`, each `late` ticks late.
  void run_to(hal::Tick tick, hal::Tick late = 0) {
    while (playback_.due() <= tick) act_at(playback_.due() + late);
    now_ = std::max(now_, tick);
  }
  void act_at(hal::Tick tick) {
    now_ = tick;
    playback_.act(now_);
  }
  void start() { playback_.start(0, now_); }
  hal::WaitOutcome outcome() {
    hal::WaitOutcome ended{};
    EXPECT_TRUE(playback_.pop_wait(ended));
    return ended;
  }
  using Words = std::vector<std::pair<hal::Tick, std::uint32_t>>;

  hal::Tick now_ = 1000;
  Words words_;
  Playback playback_{*this, kPromise, 8};
};

TEST_F(PlaybackTest, PlaysWordsWithoutAddingUpLateness) {
  for (const std::uint32_t word : {1U, 2U, 3U}) playback_.push({word, 100});
  playback_.close();
  start();
  run_to(1300, 15);
  EXPECT_EQ(words_, (Words{{1000, 1}, {1115, 2}, {1215, 3}}));
  EXPECT_TRUE(playback_.idle());
  EXPECT_FALSE(playback_.underrun());
  EXPECT_EQ(playback_.levels(), 3U) << "the last word stands";
  EXPECT_EQ(playback_.played(), 3U);
  EXPECT_EQ(playback_.late(), 0U);
}

TEST_F(PlaybackTest, CountsWordsThatAreLaterThanPromised) {
  for (const std::uint32_t word : {1U, 2U, 3U}) playback_.push({word, 100});
  playback_.close();
  start();
  act_at(1120);
  EXPECT_EQ(playback_.late(), 0U) << "as late as promised";
  act_at(1221);
  EXPECT_EQ(playback_.late(), 1U) << "a tick later";
}

TEST_F(PlaybackTest, AWordWhoseTimeHasGoneByIsAnUnderrun) {
  playback_.push({1, 100});
  playback_.push({2, 100});
  playback_.push({3, 100});
  playback_.close();
  start();
  act_at(1200);  // the second word's whole time has gone by
  EXPECT_TRUE(playback_.underrun());
  EXPECT_TRUE(playback_.idle());
  EXPECT_EQ(words_, (Words{{1000, 1}, {1200, kSafe}})) << "no word is squeezed in";
}

TEST_F(PlaybackTest, FallsToTheSafeWordWhenTheQueueRunsDry) {
  playback_.push({1, 100});
  start();
  run_to(1100);
  EXPECT_TRUE(playback_.underrun());
  EXPECT_EQ(words_, (Words{{1000, 1}, {1100, kSafe}}));
  playback_.force(0);
  EXPECT_FALSE(playback_.underrun()) << "forgotten by force()";
}

TEST_F(PlaybackTest, StartsLater) {
  playback_.push({1, 100});
  playback_.close();
  EXPECT_EQ(playback_.start(1500, now_), 1500U);
  EXPECT_TRUE(words_.empty());
  act_at(1499);
  EXPECT_TRUE(words_.empty()) << "never early";
  act_at(1500);
  EXPECT_EQ(words_, (Words{{1500, 1}}));
}

TEST_F(PlaybackTest, ResumesAtAFixedTimeAfterAnAwaitedEdge) {
  playback_.push({1, 100});
  playback_.push({1, 10'000, Until::rising, kInput});
  playback_.push({2, 100});
  playback_.close();
  start();
  run_to(1100);
  playback_.input({2000, kInput, false});
  EXPECT_TRUE(playback_.waiting()) << "a falling edge is not a rising one";
  playback_.input({3000, kInput, true});
  EXPECT_FALSE(playback_.waiting());
  run_to(4000);
  EXPECT_EQ(words_, (Words{{1000, 1}, {3050, 2}}));
  const hal::WaitOutcome ended = outcome();
  EXPECT_EQ(ended.tick, 3000U);
  EXPECT_EQ(ended.resumed, 3050U);
  EXPECT_FALSE(ended.timed_out);
}

/// The player gets to the wait late, and the edge has been read before: it counts by its stamp.
TEST_F(PlaybackTest, AnEdgeCountsByItsStampNotByWhenItIsRead) {
  playback_.push({1, 100});
  playback_.push({1, 10'000, Until::both, kInput});
  playback_.push({2, 100});
  playback_.close();
  start();
  playback_.input({1099, kInput, true});   // before the wait
  playback_.input({1100, kInput, false});  // its first tick
  act_at(1115);
  EXPECT_EQ(outcome().tick, 1100U);
}

TEST_F(PlaybackTest, AnEdgeBeforeTheWaitDoesNotCount) {
  playback_.push({1, 100});
  playback_.push({1, 10'000, Until::rising, kInput});
  start();
  playback_.input({1099, kInput, true});
  act_at(1100);
  EXPECT_TRUE(playback_.waiting());
}

TEST_F(PlaybackTest, AWaitRunsOut) {
  playback_.push({1, 100});
  playback_.push({1, 200, Until::rising, kInput});
  playback_.push({2, 100});
  playback_.close();
  start();
  run_to(1100);
  EXPECT_EQ(playback_.due(), 1330U) << "an edge of the last tick is known only `input` later";
  run_to(1500);
  const hal::WaitOutcome ended = outcome();
  EXPECT_TRUE(ended.timed_out);
  EXPECT_EQ(ended.tick, 1300U);
  EXPECT_EQ(ended.resumed, 1350U);
  EXPECT_EQ(words_, (Words{{1000, 1}, {1350, 2}}));
}

TEST_F(PlaybackTest, AnEdgeOfTheLastTickIsInTimeHoweverLateItIsRead) {
  playback_.push({1, 100});
  playback_.push({1, 200, Until::rising, kInput});
  playback_.push({2, 100});
  start();
  run_to(1100);
  now_ = 1325;
  playback_.input({1300, kInput, true});
  EXPECT_TRUE(playback_.waiting()) << "its tick is the first after the time-out";
  playback_.input({1299, kInput, true});
  EXPECT_FALSE(outcome().timed_out);
}

TEST_F(PlaybackTest, AWaitThatRunsOutCanEndTheRun) {
  playback_.push({1, 100});
  playback_.push({1, 200, Until::rising, kInput, true});
  playback_.push({2, 100});
  playback_.close();
  start();
  run_to(2000);
  EXPECT_TRUE(playback_.idle());
  EXPECT_FALSE(playback_.underrun());
  EXPECT_EQ(words_, (Words{{1000, 1}, {1330, kSafe}}));
  EXPECT_EQ(outcome().tick, 1300U);
}

TEST_F(PlaybackTest, ATripStopsEverything) {
  playback_.set_trips(1U << kInput, 1U << kInput, 0);
  playback_.push({1, 1000});
  start();
  now_ = 1234;
  playback_.input({1230, kInput + 1, true});
  EXPECT_EQ(playback_.tripped(), 0U) << "another line";
  playback_.input({1231, kInput, false});
  EXPECT_EQ(playback_.tripped(), 0U) << "the other level";
  playback_.input({1232, kInput, true});
  EXPECT_EQ(playback_.tripped(), 1U << kInput);
  EXPECT_TRUE(playback_.idle());
  EXPECT_EQ(words_, (Words{{1000, 1}, {1234, kSafe}}));
  playback_.set_trips(0, 0, 0);
  EXPECT_EQ(playback_.tripped(), 0U);
}

TEST_F(PlaybackTest, ALineThatStandsAtItsTripLevelTripsAtOnce) {
  playback_.set_trips(1U << kInput, 0, 0);
  EXPECT_EQ(playback_.tripped(), 1U << kInput);
  EXPECT_EQ(playback_.levels(), kSafe);
}

/// The firmware has checked the interlock and is about to move the outputs when it opens.
TEST_F(PlaybackTest, AForceAfterATripStaysSafe) {
  playback_.set_trips(1U << kInput, 1U << kInput, 0);
  playback_.input({1010, kInput, true});
  playback_.force(5);
  EXPECT_EQ(playback_.levels(), kSafe);
  EXPECT_EQ(words_.back().second, kSafe);
  EXPECT_EQ(playback_.tripped(), 1U << kInput) << "the firmware still has to see it";
  playback_.set_trips(0, 0, 0);
  playback_.force(5);
  EXPECT_EQ(playback_.levels(), 5U);
}

/// The firmware arms again and has not seen yet that the interlock opened for a moment.
TEST_F(PlaybackTest, ATripOfALineThatStaysWatchedIsKept) {
  playback_.set_trips(1U << kInput, 1U << kInput, 0);
  playback_.input({1010, kInput, true});
  playback_.input({1011, kInput, false});
  playback_.set_trips(1U << kInput, 1U << kInput, 0);
  EXPECT_EQ(playback_.tripped(), 1U << kInput);
  playback_.force(5);
  EXPECT_EQ(playback_.levels(), kSafe);
  playback_.set_trips(2U << kInput, 2U << kInput, 0);
  EXPECT_EQ(playback_.tripped(), 0U) << "another line";
}

TEST_F(PlaybackTest, AStartAfterATripPlaysNothing) {
  playback_.set_trips(1U << kInput, 1U << kInput, 0);
  playback_.input({1010, kInput, true});
  playback_.push({1, 1000});
  start();
  EXPECT_TRUE(playback_.idle());
  EXPECT_EQ(playback_.room(), 8U);
  EXPECT_EQ(words_.back().second, kSafe);
  EXPECT_EQ(playback_.played(), 0U);
}

TEST_F(PlaybackTest, ForceEmptiesTheQueue) {
  playback_.push({1, 1000});
  playback_.push({2, 1000});
  start();
  playback_.force(5);
  EXPECT_TRUE(playback_.idle());
  EXPECT_EQ(playback_.room(), 8U);
  EXPECT_EQ(playback_.levels(), 5U);
  EXPECT_EQ(playback_.due(), hal::kNever);
}

TEST_F(PlaybackTest, NobodyFeedsIt) {
  playback_.push({1, 1000});
  start();
  playback_.fall();
  EXPECT_TRUE(playback_.underrun());
  EXPECT_EQ(playback_.levels(), kSafe);
}

// Exact time, as on a board in virtual time: nothing is late, an edge is known in its tick.
constexpr Promise kExact{.min_dwell = 1, .lateness = 0, .wait_latency = 50, .input = 0};

/// Acts exactly when something is due. `answer`, if set, is called for each word while it is put out, as
/// devices wired to the outputs answer at once.
class ExactPlaybackTest : public testing::Test, public WordSink {
 protected:
  ExactPlaybackTest() { playback_.set_safe(kSafe); }

  hal::Tick put(std::uint32_t levels) override {
    words_.emplace_back(now_, levels);
    if (answer_) answer_(levels);
    return now_;
  }
  hal::Tick put_all(std::uint32_t levels) override { return put(levels); }

  void run_to(hal::Tick tick) {
    while (playback_.due() <= tick) {
      now_ = playback_.due();
      playback_.act(now_);
    }
    now_ = tick;
  }
  void edge(bool level) { playback_.input({now_, kInput, level}); }
  hal::WaitOutcome outcome() {
    hal::WaitOutcome ended{};
    EXPECT_TRUE(playback_.pop_wait(ended));
    return ended;
  }
  using Words = std::vector<std::pair<hal::Tick, std::uint32_t>>;

  hal::Tick now_ = 1000;
  Words words_;
  std::function<void(std::uint32_t)> answer_;
  Playback playback_{*this, kExact, 8};
};

TEST_F(ExactPlaybackTest, NoWordIsLateAndTheShortestIsPlayed) {
  for (const std::uint32_t word : {1U, 2U, 3U}) playback_.push({word, 1});
  playback_.close();
  playback_.start(0, now_);
  run_to(2000);
  EXPECT_EQ(words_, (Words{{1000, 1}, {1001, 2}, {1002, 3}}));
  EXPECT_EQ(playback_.late(), 0U);
  EXPECT_FALSE(playback_.underrun());
}

TEST_F(ExactPlaybackTest, AWaitRunsOutInItsTick) {
  playback_.push({1, 100});
  playback_.push({1, 200, Until::rising, kInput});
  playback_.push({2, 100});
  playback_.close();
  playback_.start(0, now_);
  run_to(1100);
  EXPECT_EQ(playback_.due(), 1300U);
  run_to(2000);
  const hal::WaitOutcome ended = outcome();
  EXPECT_TRUE(ended.timed_out);
  EXPECT_EQ(ended.tick, 1300U);
  EXPECT_EQ(ended.resumed, 1350U);
  EXPECT_EQ(words_, (Words{{1000, 1}, {1350, 2}}));
}

TEST_F(ExactPlaybackTest, AnEdgeOfTheVeryTickInWhichAWaitBeginsEndsIt) {
  for (const bool edge_first : {true, false}) {
    playback_.force(0);
    words_.clear();
    now_ = 1000;
    playback_.push({1, 100});
    playback_.push({1, 200, Until::falling, kInput});
    playback_.push({2, 100});
    playback_.close();
    playback_.start(0, now_);
    run_to(1099);
    now_ = 1100;
    if (edge_first) edge(false);
    playback_.act(now_);
    if (!edge_first) edge(false);
    EXPECT_EQ(outcome().tick, 1100U) << edge_first;
    run_to(1500);
    EXPECT_EQ(words_, (Words{{1000, 1}, {1150, 2}})) << edge_first;
  }
}

TEST_F(ExactPlaybackTest, ALineThatAnswersAWordMayTripInTheMiddleOfIt) {
  playback_.set_trips(1U << kInput, 1U << kInput, 0);
  answer_ = [this](std::uint32_t levels) { edge(levels == 2); };
  for (const std::uint32_t word : {1U, 2U, 3U}) playback_.push({word, 100});
  playback_.start(0, now_);
  run_to(5000);
  EXPECT_EQ(words_, (Words{{1000, 1}, {1100, 2}, {1100, kSafe}}));
  EXPECT_EQ(playback_.levels(), kSafe);
  EXPECT_EQ(playback_.played(), 2U);
  EXPECT_EQ(playback_.tripped(), 1U << kInput);
  EXPECT_TRUE(playback_.idle());
  EXPECT_FALSE(playback_.underrun()) << "a trip is no underrun";
}

TEST_F(ExactPlaybackTest, ALineThatStillStandsAtItsTripLevelTripsWhenInputsAreReadAgain) {
  playback_.set_trips(1U << kInput, 1U << kInput, 0);
  edge(true);
  ASSERT_EQ(playback_.tripped(), 1U << kInput);
  playback_.set_trips(0, 0, 0);
  playback_.set_trips(1U << kInput, 1U << kInput, 0);  // it has gone back
  playback_.push({1, 100});
  playback_.start(0, now_);
  playback_.inputs_are(0);
  EXPECT_FALSE(playback_.idle());
  playback_.inputs_are(1U << kInput);
  EXPECT_TRUE(playback_.idle());
  EXPECT_EQ(playback_.levels(), kSafe);
}

}  // namespace
}  // namespace symrig::board_common::test::playback_test
