// SPDX-License-Identifier: Apache-2.0
#include "measure.hpp"

#include "assert_ok.hpp"
#include "fake_gpio.hpp"

#include <filesystem>

#include <gtest/gtest.h>

namespace symrig::board_linux::test::measure_test {
namespace {

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
}  // namespace symrig::board_linux::test::measure_test
