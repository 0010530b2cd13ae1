// SPDX-License-Identifier: Apache-2.0
// The player's thread against lines in memory. Nothing here depends on how fast the machine is: what is late
// is late.
#include "player.hpp"

#include "assert_ok.hpp"
#include "clock.hpp"
#include "fake_gpio.hpp"
#include "measure.hpp"

#include <chrono>
#include <filesystem>
#include <thread>

#include <gtest/gtest.h>

namespace symrig::board_linux::test::player_test {
namespace {

using namespace std::chrono_literals;
using hal::Until;

constexpr std::uint32_t kOutputs = 0xFF;
constexpr std::uint8_t kInput = 8;
constexpr std::uint32_t kSafe = 0x80;

PlayerOptions options() {
  PlayerOptions made;
  made.promise = {
      .min_dwell = 1'000'000, .lateness = 100'000'000, .wait_latency = 2'000'000, .input = 1'000'000};
  made.output_mask = kOutputs;
  made.depth = 64;
  made.patience = 60'000 * kMillisecond;
  return made;
}

template <class Condition>
bool comes_true(Condition condition) {
  for (int k = 0; k < 6000; ++k) {
    if (condition()) return true;
    std::this_thread::sleep_for(5ms);
  }
  return false;
}

class PlayerTest : public testing::Test {
 protected:
  explicit PlayerTest(const PlayerOptions& with = options()) : player_(gpio_, with) {
    player_.set_safe(kSafe);
    player_.begin();
  }
  bool ends() {
    return comes_true([this] { return player_.idle(); });
  }

  FakeGpio gpio_;
  Player player_;
  PinCapture capture_{player_};
};

// Words of a second, so that no load makes one miss its own end.
constexpr std::uint32_t kLong = 1'000'000'000;

TEST_F(PlayerTest, PutsWordsOutInOrder) {
  player_.push({1, kLong / 20});
  player_.push({2, kLong / 20});
  player_.push({3, kLong});
  player_.close();
  const hal::Tick begin = player_.start(0);
  ASSERT_TRUE(ends());
  const std::vector<std::uint32_t> words = gpio_.words();
  if (player_.underrun()) {
    // The machine stood still for the length of a word: no word after it, but the safe one.
    ASSERT_GE(words.size(), 2U);
    EXPECT_LE(words.size(), 3U);
    for (std::uint32_t k = 0; k + 1 < words.size(); ++k) EXPECT_EQ(words[k], k + 1);
    EXPECT_EQ(words.back(), kSafe);
    EXPECT_EQ(player_.levels(), kSafe);
    return;
  }
  EXPECT_GE(monotonic_now(), begin + kLong) << "words stand as long as they should";
  EXPECT_EQ(words, (std::vector<std::uint32_t>{1, 2, 3}));
  EXPECT_EQ(player_.levels(), 3U);
}

TEST_F(PlayerTest, StampsItsOwnOutputs) {
  capture_.watch(kOutputs);
  const hal::Tick before = monotonic_now();
  player_.force(5);
  const hal::Tick after = monotonic_now();
  hal::CapturedEdge first{};
  hal::CapturedEdge second{};
  ASSERT_TRUE(comes_true([&] { return capture_.pop(first); }));
  ASSERT_TRUE(comes_true([&] { return capture_.pop(second); }));
  EXPECT_EQ(first.line, 0);
  EXPECT_EQ(second.line, 2);
  EXPECT_TRUE(before <= first.tick && first.tick <= after);
  EXPECT_EQ(capture_.levels(), 5U);
}

TEST_F(PlayerTest, AWaitEndsWithItsEdge) {
  player_.push({1, kLong / 1000});
  player_.push({1, 4'000'000'000, Until::rising, kInput});
  player_.push({2, kLong});
  player_.close();
  const hal::Tick begin = player_.start(0);
  std::this_thread::sleep_for(20ms);
  const hal::Tick edge = monotonic_now();
  gpio_.edge({edge, kInput, true});
  hal::WaitOutcome ended{};
  ASSERT_TRUE(comes_true([&] { return player_.pop_wait(ended); }));
  EXPECT_GT(edge, begin);
  EXPECT_EQ(ended.tick, edge);
  EXPECT_EQ(ended.resumed, edge + options().promise.wait_latency);
}

TEST_F(PlayerTest, ATripNeedsNoHelp) {
  player_.set_trips(1U << kInput, 1U << kInput);
  player_.push({1, kLong});
  player_.push({1, kLong});
  player_.start(0);
  gpio_.edge({monotonic_now(), kInput, true});
  ASSERT_TRUE(comes_true([&] { return player_.tripped() != 0; }));
  EXPECT_EQ(player_.tripped(), 1U << kInput);
  EXPECT_EQ(gpio_.outputs(), kSafe);
  EXPECT_TRUE(player_.idle());
}

/// An input chatters: there is always one more edge to read. Words, trips and the end of the run come all the
/// same.
TEST_F(PlayerTest, AStormOfEdgesStopsNothing) {
  constexpr std::uint8_t kOther = kInput + 1;
  gpio_.storm(kOther);
  player_.push({1, kLong});
  player_.push({2, kLong});
  player_.close();
  player_.start(0);
  const bool ended = ends();
  player_.set_trips(1U << kInput, 1U << kInput);
  gpio_.edge({monotonic_now(), kInput, true});
  const bool tripped = comes_true([&] { return player_.tripped() != 0; });
  gpio_.storm(std::nullopt);
  EXPECT_TRUE(ended);
  EXPECT_EQ(player_.played(), 2U);
  EXPECT_TRUE(tripped);
  EXPECT_EQ(gpio_.outputs(), kSafe);
  EXPECT_TRUE(capture_.take_overflow()) << "edges that found no room are told";
}

/// The edge itself was lost, but that one was is known: levels are read again.
TEST_F(PlayerTest, ALostEdgeTripsAndIsTold) {
  player_.set_trips(1U << kInput, 1U << kInput);
  player_.push({1, kLong});
  player_.start(0);
  gpio_.lose_edge(kInput, true);
  ASSERT_TRUE(comes_true([&] { return player_.tripped() != 0; }));
  EXPECT_EQ(gpio_.outputs(), kSafe);
  EXPECT_TRUE(capture_.take_overflow());
  EXPECT_FALSE(capture_.take_overflow()) << "reading clears it";
}

TEST_F(PlayerTest, ForceComesThroughAtAnyTime) {
  player_.push({1, kLong});
  player_.push({2, kLong});
  player_.start(0);
  player_.force(9);
  EXPECT_EQ(gpio_.outputs(), 9U);
  std::this_thread::sleep_for(20ms);
  EXPECT_EQ(gpio_.outputs(), 9U) << "nothing of the old queue follows";
}

TEST_F(PlayerTest, TellsThatLinesDoNotObey) {
  EXPECT_EQ(player_.broken(), 0);
  gpio_.break_down();
  player_.force(1);
  EXPECT_EQ(player_.broken(), EIO);
}

/// Two threads at it, for the thread sanitizer.
TEST_F(PlayerTest, IsSafeToCallWhileItPlays) {
  for (int round = 0; round < 20; ++round) {
    for (std::uint32_t k = 0; player_.room() > 1; ++k) player_.push({k & 0xFU, 100'000});
    player_.start(0);
    for (int k = 0; k < 50; ++k) {
      gpio_.edge({monotonic_now(), kInput, k % 2 == 0});
      hal::CapturedEdge edge{};
      capture_.pop(edge);
      [[maybe_unused]] const auto seen =
          player_.played() + player_.late() + player_.levels() + capture_.levels();
      player_.feed();
    }
    player_.force(0);
    EXPECT_EQ(gpio_.outputs(), 0U);
  }
}

class HungryPlayer : public PlayerTest {
 protected:
  HungryPlayer() : PlayerTest(hungry()) {}
  /// The thread looks at everything once more, and has done so.
  bool comes_round() {
    const hal::Tick now = monotonic_now();
    gpio_.edge({now, kInput, false});  // wakes it
    return comes_true([&] { return player_.last_round() > now; });
  }
  static PlayerOptions hungry() {
    PlayerOptions made = options();
    made.patience = 200 * kMillisecond;
    return made;
  }
};

/// The dead man: the main loop hangs, the outputs do not.
TEST_F(HungryPlayer, MakesSafeWhenNobodyFeedsIt) {
  player_.push({1, 4'000'000'000});
  player_.push({1, 4'000'000'000});
  player_.start(0);
  ASSERT_TRUE(comes_true([&] { return gpio_.outputs() == kSafe; }));
  EXPECT_TRUE(comes_true([&] { return player_.take_starved(); }));
  EXPECT_TRUE(player_.underrun());
}

TEST_F(HungryPlayer, IsExcusedForSomethingLong) {
  // A busy machine may have let it starve before, or just while it is excused: then once more.
  do {
    player_.excuse(600'000 * kMillisecond);
    ASSERT_TRUE(comes_round());
  } while (player_.take_starved());
  player_.force(1);
  std::this_thread::sleep_for(500ms);  // longer than its patience
  EXPECT_EQ(gpio_.outputs(), 1U);
  EXPECT_FALSE(player_.take_starved());
}

Measured made_up() {
  return {100,
          {1'000, 4'000, 9'000},
          {2'000, 5'000, 30'000},
          {1'000, 2'000, 8'000},
          {3'000, 5'000, 20'000},
          {50, 100, 2'000}};
}

TEST(Abilities, PromiseLessThanTheWorstThatWasSeen) {
  const Abilities can = abilities(made_up(), 0, 4096);
  EXPECT_GE(can.promise.lateness, 2 * 30'000U);
  EXPECT_GE(can.promise.min_dwell, 2 * can.promise.lateness) << "a word outlasts its neighbour's lateness";
  EXPECT_GE(can.promise.input, 2 * 20'000U);
  EXPECT_GT(can.promise.wait_latency, can.promise.input)
      << "the end of a wait is known before the next word is due";
  EXPECT_GE(can.output_stamp, 8'000U);
  EXPECT_GE(can.input_stamp, 9'000U);
}

TEST(Abilities, AFullQueueOutlastsAPoll) {
  for (const std::uint64_t worst :
       {std::uint64_t{1'000}, std::uint64_t{1'000'000}, std::uint64_t{100'000'000}}) {
    Measured measured = made_up();
    measured.wake.most = worst;
    const Abilities can = abilities(measured, 0, 4096);
    EXPECT_GT((4096ULL - 32) * can.refill_ticks, can.poll_ticks) << "rule refill would refuse every program";
  }
}

TEST(Abilities, TheUserMayPromiseWhatHeNeeds) {
  const Abilities can = abilities(made_up(), 500'000, 4096);
  EXPECT_EQ(can.promise.lateness, 500'000U);
  EXPECT_GE(can.promise.min_dwell, 1'000'000U);
}

TEST(Abilities, AMachineThatIsSecondsLateIsStillABoardThatAddsUp) {
  Measured measured = made_up();
  measured.word.most = measured.wake.most = measured.nudge.most = measured.set.most = 5'000'000'000;
  const Abilities can = abilities(measured, 0, 4096);
  EXPECT_LE(can.promise.lateness, 200'000'000U);
  EXPECT_GE(can.promise.min_dwell, 2 * can.promise.lateness);
}

TEST(Measure, LooksAtEverything) {
  FakeGpio gpio;
  const Measured measured = measure(gpio, 3, 20, 0);
  EXPECT_EQ(measured.wakes, 20U);
  for (const Spread& spread : {measured.wake, measured.word, measured.set, measured.nudge, measured.push}) {
    EXPECT_LE(spread.least, spread.median);
    EXPECT_LE(spread.median, spread.most);
    EXPECT_GT(spread.most, 0U);
  }
  EXPECT_EQ(gpio.outputs(), 3U) << "outputs stay as they are";
}

TEST(Measure, IsKeptAndTheWorseCounts) {
  const auto path =
      std::filesystem::temp_directory_path() / ("symrig-measured-" + std::to_string(::getpid()));
  EXPECT_EQ(load_measured(path).wakes, 0U);
  ASSERT_OK(save_measured(path, made_up()));
  const Measured kept = load_measured(path);
  std::filesystem::remove(path);
  EXPECT_EQ(kept.word.most, 30'000U);
  Measured now = made_up();
  now.word.most = 1;
  now.set.most = 99'000;
  const Measured both = worse(now, kept);
  EXPECT_EQ(both.word.most, 30'000U);
  EXPECT_EQ(both.set.most, 99'000U);
}

}  // namespace
}  // namespace symrig::board_linux::test::player_test
