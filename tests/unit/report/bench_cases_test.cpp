// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/bench.hpp"

#include <algorithm>

#include <gtest/gtest.h>

namespace symrig::bench_cases_test {
namespace {

BenchPlan small_plan() {
  BenchPlan plan;
  plan.scenes = {"gummy", "plane"};
  plan.sizes = {{16, 16}, {80, 60}};
  plan.seeds = {1, 2};
  plan.sweeps = {{Algorithm::paper, {1e-3}, 3e-4},
                 {Algorithm::symrig, {1e-4, 1e-2, 1e-4}, 3e-4},
                 {Algorithm::brute, {}, 0}};
  return plan;
}

// 2 scenes × 2 seeds × (paper: 1e-3 and its preset; symrig: 1e-2, 1e-4; brute once) = 20 on the small grid;
// the large one has 4,800 pixels, too many for brute force: 16.
TEST(BenchCases, are_every_combination_once) {
  const std::vector<BenchCase> cases = bench_cases(small_plan());
  EXPECT_EQ(cases.size(), 36U);
  for (auto one = cases.begin(); one != cases.end(); ++one)
    EXPECT_EQ(std::count(cases.begin(), cases.end(), *one), 1);
}

// Every rig runs the same captures.
TEST(BenchCases, are_the_same_on_every_rig) {
  BenchPlan plan = small_plan();
  plan.profiles = {"screen60", "video"};
  const std::vector<BenchCase> cases = bench_cases(plan);
  ASSERT_EQ(cases.size(), 72U);
  for (std::size_t k = 0; k < 36; ++k) {
    BenchCase other = cases[k];
    EXPECT_EQ(other.profile, "screen60");
    other.profile = "video";
    EXPECT_EQ(cases[k + 36], other);
  }
  EXPECT_EQ(bench_rig(plan, cases[40]).find("&profile=video") == std::string::npos, false);
}

TEST(BenchCases, brute_force_stays_on_small_grids) {
  const auto brute_on = [](Grid grid) {
    const std::vector<BenchCase> cases = bench_cases(small_plan());
    return std::count_if(cases.begin(), cases.end(), [grid](const BenchCase& c) {
      return c.algorithm == Algorithm::brute && c.grid == grid;
    });
  };
  EXPECT_EQ(brute_on({16, 16}), 4);
  EXPECT_EQ(brute_on({80, 60}), 0);
}

TEST(BenchCases, go_from_loose_to_tight_and_hold_the_reference) {
  const std::vector<BenchCase> cases = bench_cases(small_plan());
  const std::vector<BenchCase> first(cases.begin(), cases.begin() + 5);
  const BenchCase like{.scene = "gummy", .grid = {16, 16}, .seed = 1};
  const auto expected = [&like](Algorithm algorithm, std::optional<double> tolerance, bool preset) {
    BenchCase one = like;
    one.algorithm = algorithm;
    one.tolerance = tolerance;
    one.preset = preset;
    return one;
  };
  EXPECT_EQ(first[0], expected(Algorithm::paper, 1e-3, false));
  EXPECT_EQ(first[1],
            expected(Algorithm::paper, 3e-4, true));  // not asked for, but the summary is read there
  EXPECT_EQ(first[2], expected(Algorithm::symrig, 1e-2, false));
  EXPECT_EQ(first[3], expected(Algorithm::symrig, 1e-4, false));
  EXPECT_EQ(first[4], expected(Algorithm::brute, {}, true));
}

TEST(BenchCases, name_the_rig_they_run_on) {
  BenchPlan plan = small_plan();
  plan.camera_noise = false;
  plan.channels = 3;
  EXPECT_EQ(bench_rig(plan, {.scene = "gummy", .grid = {80, 60}, .seed = 2}),
            "sim:gummy?size=80x60&seed=2&channels=3&noise=off");
}

}  // namespace
}  // namespace symrig::bench_cases_test
