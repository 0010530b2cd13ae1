// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/bench_summary.hpp"

#include "bench_runs.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace symrig::bench_summary_test {
namespace {

constexpr double kRounding = 1e-12;

void expect_reading(const Reading& reading, Reach reach, double value) {
  EXPECT_EQ(reading.reach, reach);
  EXPECT_NEAR(reading.value, value, kRounding);
}

// symrig's envelope goes straight from (100, 0.1) to (400, 0.001): indirect 0.01 is half way, at 200
// patterns, half of paper's 400. Its bar_indirect is below 0.02 from the first capture on: at most 100 of
// 400. At 400 patterns its errors are 0.001 of 0.01 and 0.003 of 0.03.
TEST(BenchSummary, compares_at_equal_error_and_at_equal_patterns) {
  const std::vector<BenchSummary> all = summarize(test::small_run());
  ASSERT_EQ(all.size(), 1U);
  ASSERT_EQ(all.front().pairs.size(), 2U);
  for (const BenchPair& pair : all.front().pairs) {
    EXPECT_EQ(pair.scene, "gummy");
    EXPECT_EQ(pair.paper_patterns, 400);
    expect_reading(pair.patterns_at_indirect, Reach::read, 0.5);
    expect_reading(pair.patterns_at_bar_indirect, Reach::at_most, 0.25);
    expect_reading(pair.patterns_at_both, Reach::read, 0.5);
    expect_reading(pair.indirect_at_patterns, Reach::read, 0.1);
    expect_reading(pair.frobenius_at_patterns, Reach::read, 0.1);
  }
  EXPECT_NEAR(all.front().patterns_at_indirect.value, 0.5, kRounding);
  EXPECT_EQ(all.front().patterns_at_bar_indirect.bounds, 2);
}

// The second seed of paper is better than any capture of symrig: √(0.5) would flatter, so it is said.
TEST(BenchSummary, an_error_that_is_not_reached_is_counted_and_not_averaged) {
  BenchRun run = test::small_run();
  run.captures[4].error.indirect = 1e-6;
  const BenchSummary summary = summarize(run).front();
  EXPECT_EQ(summary.pairs[1].patterns_at_indirect.reach, Reach::not_reached);
  EXPECT_EQ(summary.patterns_at_indirect.averaged, 1);
  EXPECT_EQ(summary.patterns_at_indirect.not_reached, 1);
  EXPECT_EQ(summary.patterns_at_indirect.reach(), Reach::not_reached);
}

TEST(BenchSummary, seeds_are_compared_with_themselves) {
  BenchRun run = test::small_run();
  run.captures[4].patterns = 200;  // paper, seed 2
  const BenchSummary summary = summarize(run).front();
  expect_reading(summary.pairs[0].patterns_at_indirect, Reach::read, 0.5);
  expect_reading(summary.pairs[1].patterns_at_indirect, Reach::read, 1);
  // √(0.5 · 1)
  EXPECT_NEAR(summary.patterns_at_indirect.value, std::sqrt(0.5), kRounding);
}

TEST(BenchSummary, captures_that_failed_take_no_part) {
  BenchRun run = test::small_run();
  run.captures[0].failure = "the lamp is off";  // paper, seed 1
  const BenchSummary summary = summarize(run).front();
  ASSERT_EQ(summary.pairs.size(), 1U);
  EXPECT_EQ(summary.pairs.front().seed, 2);
}

TEST(BenchSummary, without_both_algorithms_there_is_nothing_to_compare) {
  BenchRun run = test::small_run();
  std::erase_if(run.captures, [](const BenchCapture& c) { return c.what.algorithm == Algorithm::paper; });
  const BenchSummary summary = summarize(run).front();
  EXPECT_TRUE(summary.pairs.empty());
  EXPECT_EQ(summary.patterns_at_indirect.averaged, 0);
  EXPECT_EQ(summarize(BenchRun{}).size(), 0U);
}

// flood is twice frobenius in every capture by hand; one is made worse.
TEST(BenchSummary, flood_bias_is_the_worst_over_seeds_and_sweep) {
  BenchRun run = test::small_run();
  run.captures[5].error.flood = 0.009;  // symrig, seed 2, default tolerance: 3 × frobenius
  run.captures[6].error.flood = 2.5;    // the same, another tolerance: 5 × frobenius
  const BenchSummary summary = summarize(run).front();
  for (const FloodBias& bias : summary.flood) {
    const bool symrig = bias.algorithm == Algorithm::symrig;
    EXPECT_NEAR(bias.at_preset, symrig ? 3 : 2, kRounding);
    EXPECT_NEAR(bias.worst, symrig ? 5 : 2, kRounding);
  }
}

}  // namespace
}  // namespace symrig::bench_summary_test
