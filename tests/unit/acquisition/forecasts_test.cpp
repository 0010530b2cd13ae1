// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/forecasts.hpp"

#include "acquisition/search/tolerance.hpp"
#include "broken_off.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::acquisition::search_forecast_test {
namespace {

constexpr double kDirect = 0.05;

/// The plan looks at `children`: they have to outlive it.
LevelPlan plan(int level, std::int64_t planned, std::span<const double> children, std::int64_t before = 0) {
  return {.level = level, .planned = planned, .before = before, .children = children};
}

TEST(SearchForecast, nothing_is_known_before_level_1_and_where_blocks_share_nothing) {
  const std::vector<double> children(6, 4.0);
  EXPECT_FALSE(forecast_later(plan(0, 4, children)).known());
  EXPECT_TRUE(forecast_later(plan(1, 16, children)).known());
  EXPECT_FALSE(forecast_later(plan(3, 256, children)).known());  // every block by itself
  EXPECT_FALSE(forecast_later(plan(6, 40, children)).known());
  EXPECT_FALSE(forecast_later({}).known());
}

TEST(SearchForecast, after_the_last_level_only_the_direct_light_is_left) {
  const std::vector<double> children(6, 4.0);
  LevelPlan last = plan(5, 64, children, 44);
  last.taken = 200;
  last.direct_share = kDirect;
  EXPECT_EQ(forecast_later(last).least, 0);
  EXPECT_EQ(forecast_later(last).most, 10);
}

TEST(SearchForecast, blocks_of_few_pixels_have_fewer_children_to_light) {
  const std::vector<double> all_four(6, 4.0), near_pixels{4, 4, 4, 4, 3, 1.25};
  const auto whole = forecast_later(plan(3, 40, all_four, 40));
  const auto few = forecast_later(plan(3, 40, near_pixels, 40));
  EXPECT_LT(few.least, whole.least);
  EXPECT_LT(few.most, whole.most);
  EXPECT_GT(few.least, 0);
}

// A growth that was seen to be small narrows what may come; a large one does not widen it for ever.
TEST(SearchForecast, learns_from_the_level_before) {
  const std::vector<double> children(8, 4.0);
  const auto calm = forecast_later(plan(4, 40, children, 40));
  const auto steep = forecast_later(plan(4, 40, children, 10));
  EXPECT_EQ(calm.least, steep.least);
  EXPECT_LT(calm.most, steep.most);
}

}  // namespace

}  // namespace symrig::acquisition::search_forecast_test

namespace symrig::foretold_captures_test {

// Captures on the rig's own clock, which is the same on every machine: what is told of the time to go holds.

namespace {

struct Moment {
  double at;
  std::optional<double> left;
  std::string stage;
};

/// Every moment at which progress was told.
std::vector<Moment> captured(const std::string& uri, Algorithm algorithm) {
  auto rig = open_virtual_rig(uri);
  EXPECT_TRUE(rig.ok()) << uri;
  if (!rig) return {};
  CaptureOptions options;
  options.algorithm = algorithm;
  options.rule = default_rule(algorithm);
  options.economy = default_economy(algorithm);
  TimeToGo to_go;
  std::vector<Moment> moments;
  options.progress = [&](const ProgressEvent& event) {
    const double at = (*rig)->cost().rig_seconds;
    to_go.report(event, at);
    moments.push_back({at, to_go.seconds(), std::string(event.stage)});
    return true;
  };
  const auto result = capture(**rig, options);
  EXPECT_TRUE(result.ok()) << uri;
  moments.push_back({(*rig)->cost().rig_seconds, {}, "end"});
  return moments;
}

struct Case {
  const char* uri;
  Algorithm algorithm = Algorithm::symrig;
};

class Foretold : public ::testing::TestWithParam<Case> {};

TEST_P(Foretold, is_right_within_a_factor_of_two_after_a_tenth) {
  const std::vector<Moment> moments = captured(GetParam().uri, GetParam().algorithm);
  ASSERT_GT(moments.size(), 4U);
  const double end = moments.back().at;
  int told = 0;
  for (const Moment& moment : moments) {
    if (moment.at < 0.1 * end || !moment.left) continue;
    ++told;
    EXPECT_GE(*moment.left, 0.5 * (end - moment.at)) << moment.stage << " at " << moment.at << " of " << end;
    EXPECT_LE(*moment.left, 2.0 * (end - moment.at)) << moment.stage << " at " << moment.at << " of " << end;
  }
  EXPECT_GT(told, 0);
}

INSTANTIATE_TEST_SUITE_P(
    Captures, Foretold,
    ::testing::Values(Case{"sim:gummy?size=40x40&seed=5"}, Case{"sim:vgroove-textured?size=48x32&seed=6"},
                      Case{"sim:occluder?size=32x48&seed=7"}, Case{"sim:vgroove-mixed?size=50x39&noise=off"},
                      Case{"sim:mirror?size=32x32&seed=9"}, Case{"sim:views2?size=40x48&seed=4"},
                      Case{"sim:gummy?size=32x32&seed=8", Algorithm::paper},
                      Case{"sim:gummy?size=16x24&seed=8", Algorithm::brute}),
    [](const auto& one) { return "case_" + std::to_string(one.index); });

}  // namespace

}  // namespace symrig::foretold_captures_test

namespace symrig::target_test {

// A target error chooses the tolerance, and a forecast says what it will take.

namespace {

using acquisition::TargetTolerance;

constexpr double kUsual = 3e-4;

CaptureSettings settings(double target) {
  return *settings_of({.target_error = target});
}

CaptureResult ended_with(double error, double half_width = 0) {
  CaptureResult result;
  result.estimated = TransportErrors{.frobenius = error};
  result.estimated_half_width.frobenius = half_width;
  return result;
}

TEST(TargetTolerance, is_that_of_the_user_without_a_target_or_with_a_tolerance_of_their_own) {
  EXPECT_EQ(TargetTolerance(settings(0)).coarseness().steps, 0);
  EXPECT_EQ(TargetTolerance(*settings_of({.tolerance = kUsual, .target_error = 0.1})).coarseness().steps, 0);
  EXPECT_EQ(TargetTolerance(*settings_of({.rule = default_rule(Algorithm::symrig), .target_error = 0.1}))
                .coarseness()
                .steps,
            0);
}

TEST(TargetTolerance, is_coarser_for_a_larger_target_and_never_finer_than_without) {
  int before = 0;
  for (const double target : {1e-6, 1e-3, 5e-3, 1e-2, 2e-2, 5e-2, 0.2, 0.9}) {
    const int steps = TargetTolerance(settings(target)).coarseness().steps;
    EXPECT_GE(steps, before) << target;
    // The tolerance leaves room for the error that it causes.
    if (steps > 0) {
      EXPECT_LT(kUsual * acquisition::Coarseness{steps}.factor(), target / 4) << target;
    }
    before = steps;
  }
  EXPECT_GT(before, 0);
}

TEST(TargetTolerance, searches_again_until_the_target_is_reached_or_the_tolerance_is_the_users) {
  TargetTolerance target(settings(0.05));
  const int first = target.coarseness().steps;
  ASSERT_GT(first, 0);
  EXPECT_FALSE(target.search_again(ended_with(0.03, 0.01)));
  EXPECT_TRUE(target.search_again(ended_with(0.04, 0.02)));  // the uncertainty counts
  EXPECT_LT(target.coarseness().steps, first);
  int searches = 1;
  while (target.search_again(ended_with(0.06))) ++searches;
  EXPECT_EQ(target.coarseness().steps, 0);
  EXPECT_LE(searches, first);
}

TEST(TargetTolerance, the_further_above_the_target_the_finer_is_the_next_search) {
  std::vector<int> steps;
  for (const double error : {0.055, 0.1, 0.4}) {
    TargetTolerance target(settings(0.05));
    ASSERT_TRUE(target.search_again(ended_with(error)));
    steps.push_back(target.coarseness().steps);
  }
  EXPECT_TRUE(std::is_sorted(steps.rbegin(), steps.rend()));
  EXPECT_LT(steps.back(), steps.front());
}

TEST(TargetTolerance, does_not_search_again_after_a_budget_or_in_the_dark) {
  CaptureResult budget = ended_with(0.5);
  budget.stopped_by = "max_patterns";
  EXPECT_FALSE(TargetTolerance(settings(0.05)).search_again(budget));
  EXPECT_FALSE(
      TargetTolerance(settings(0.05)).search_again(ended_with(std::numeric_limits<double>::quiet_NaN())));
  CaptureResult wrong_leaves;
  wrong_leaves.undetermined = Undetermined{};
  EXPECT_TRUE(TargetTolerance(settings(0.05)).search_again(wrong_leaves));
}

struct Captured {
  CaptureResult result;
  double rig_seconds;
  std::vector<CaptureForecast> foretold;
};

Captured captured(const char* uri, CaptureOptions options) {
  auto rig = open_virtual_rig(uri);
  EXPECT_TRUE(rig.ok()) << uri;
  std::vector<CaptureForecast> foretold;
  options.foretell = [&](const CaptureForecast& forecast) { foretold.push_back(forecast); };
  auto result = capture(**rig, options);
  EXPECT_TRUE(result.ok()) << uri << ": " << result.error().line();
  return {*std::move(result), (*rig)->cost().rig_seconds, std::move(foretold)};
}

double stated(const CaptureResult& result) {
  return result.estimated->frobenius + result.estimated_half_width.frobenius;
}

/// Each costs no more than a capture without a target, in patterns or in seconds: it may end earlier, and its
/// photographs may be noisier.
TEST(Target, is_reached_with_fewer_patterns_in_less_time) {
  for (const char* uri : {"sim:gummy?size=32x32", "sim:vgroove-textured?size=32x40&seed=3",
                          "sim:occluder?size=40x32&channels=3", "sim:random?seed=33&size=32x32"}) {
    const Captured whole = captured(uri, {});
    const Captured near = captured(uri, {.target_error = 0.05});
    EXPECT_EQ(near.result.stopped_by, "target_error") << uri;
    EXPECT_LE(stated(near.result), 0.05) << uri;
    EXPECT_LT(near.result.patterns, whole.result.patterns) << uri;
    EXPECT_LT(near.rig_seconds, whole.rig_seconds) << uri;
    EXPECT_EQ(whole.result.tolerance, kUsual) << uri;
    EXPECT_GT(near.result.tolerance, kUsual) << uri;
  }
}

constexpr const char* kTwice = "sim:views2?size=24x24&exposures=4";  // views miss more than other scenes

TEST(Target, that_the_first_search_misses_is_reached_by_the_next) {
  const Captured twice = captured(kTwice, {.target_error = 0.03});
  ASSERT_EQ(twice.foretold.size(), 2U);
  EXPECT_EQ(twice.result.stopped_by, "target_error");
  EXPECT_LE(stated(twice.result), 0.03);
  EXPECT_GT(twice.foretold[1].patterns, twice.foretold[0].patterns);
  EXPECT_EQ(twice.result.forecast->patterns, twice.foretold[0].patterns);
  const CaptureResult& result = twice.result;
  EXPECT_EQ(
      std::accumulate(result.patterns_per_level.begin(), result.patterns_per_level.end(), std::int64_t{0}),
      result.patterns);
  EXPECT_EQ(result.steps.size(), result.error_per_level.size());
  EXPECT_EQ(result.held_out.size() % 4, 2U);  // six, and further sets of four
  for (std::size_t k = 1; k < result.steps.size(); ++k)
    EXPECT_GE(result.steps[k].patterns, result.steps[k - 1].patterns);
}

TEST(Target, broken_off_in_either_search_and_continued_is_the_same) {
  tests::expect_continued_is_the_same(kTwice, {.target_error = 0.03});
}

TEST(Target, beside_a_budget_of_patterns_keeps_to_it) {
  for (const std::int64_t most : {7, 30, 100}) {
    const Captured bound = captured(kTwice, {.max_patterns = most, .target_error = 0.05});
    EXPECT_LE(bound.result.patterns, most);
    EXPECT_EQ(bound.result.stopped_by, "max_patterns");
  }
}

/// A factor of 2, as for the time to go: a few scenes exceed 1.5 (docs/research/error-per-second.md).
TEST(Forecast, of_the_whole_capture_is_about_right) {
  for (const char* uri : {"sim:gummy?size=40x40&seed=5", "sim:vgroove-textured?size=48x32&seed=6",
                          "sim:occluder?size=32x48&seed=7", "sim:vgroove-mixed?size=50x39&noise=off",
                          "sim:mirror?size=32x32&seed=9&exposures=4", "sim:views2?size=40x48&seed=4"}) {
    const Captured whole = captured(uri, {});
    ASSERT_EQ(whole.foretold.size(), 1U) << uri;
    const CaptureForecast& forecast = whole.foretold[0];
    EXPECT_GT(2.0 * static_cast<double>(forecast.patterns), static_cast<double>(whole.result.patterns))
        << uri;
    EXPECT_LT(0.5 * static_cast<double>(forecast.patterns), static_cast<double>(whole.result.patterns))
        << uri;
    EXPECT_GT(2.0 * forecast.rig_seconds, whole.rig_seconds) << uri;
    EXPECT_LT(0.5 * forecast.rig_seconds, whole.rig_seconds) << uri;
  }
}

TEST(Forecast, of_a_scene_without_light_between_pixels_is_a_few_photographs) {
  for (const char* uri : {"sim:plane?size=64x64&noise=off", "sim:plane?size=64x64"}) {
    const Captured plane = captured(uri, {});
    ASSERT_EQ(plane.foretold.size(), 1U);
    EXPECT_GE(plane.foretold[0].patterns, plane.result.patterns) << uri;
    EXPECT_LE(plane.foretold[0].patterns, 16) << uri;
  }
}

TEST(Forecast, is_never_above_a_budget) {
  for (const std::int64_t most : {7, 20, 60}) {
    const Captured bound = captured("sim:gummy?size=32x32&exposures=4", {.max_patterns = most});
    ASSERT_EQ(bound.foretold.size(), 1U);
    EXPECT_LE(bound.foretold[0].patterns, most);
  }
  const Captured few = captured("sim:gummy?size=32x32&exposures=4", {.max_seconds = 120});
  ASSERT_EQ(few.foretold.size(), 1U);
  EXPECT_LE(few.foretold[0].rig_seconds, 120);
  EXPECT_FALSE(captured("sim:gummy?size=32x32", {.max_patterns = 5}).result.forecast);
}

}  // namespace

}  // namespace symrig::target_test
