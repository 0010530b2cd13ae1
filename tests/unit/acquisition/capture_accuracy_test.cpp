// SPDX-License-Identifier: Apache-2.0
// Captures on rigs with drift, channels and planned exposures, broken off and continued.
#include "broken_off.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/sim/scene.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "workbench.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::broken_off_test {
namespace {

class BrokenOff : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Rigs, BrokenOff,
                         testing::Values("sim:vgroove-textured?size=13x17&drift=0.5&dead=0.02&exposures=4",
                                         "sim:gummy?size=12x9&channels=3&exposures=3&flare=0.01",
                                         "sim:gummy?size=12x9&exposures=auto&drift=0.5",
                                         "sim:gummy?size=12x9&exposures=2&profile=dlpc350",
                                         "sim:gummy?size=12x9&exposures=auto&profile=dlpc350"),
                         [](const auto& rig) { return "rig" + std::to_string(rig.index + 1); });

TEST_P(BrokenOff, anywhere_and_continued_a_capture_is_the_same) {
  tests::expect_continued_is_the_same(GetParam());
}

}  // namespace

}  // namespace symrig::broken_off_test

namespace symrig::finer_tolerance_test {

// A finer tolerance on a noisy scene costs photographs, not accuracy.

namespace {

using tests::default_options;

/// Dark blocks beside bright ones: below the noise of direct light, weak light may only be looked for where
/// no direct light is. A finer tolerance must not make the indirect light worse.
TEST(Scenes, a_finer_tolerance_does_not_drown_in_noise) {
  for (const int seed : {1, 2, 3}) {
    const std::string uri = "sim:occluder?size=64x64&noise=camera&seed=" + std::to_string(seed);
    const auto scene = make_scene(*parse_scene_uri(uri));
    ASSERT_TRUE(scene.ok());
    double before = 1;
    for (const double tolerance : {3e-4, 1e-4, 4e-5, 2e-5}) {
      const auto rig = open_virtual_rig(uri);
      ASSERT_TRUE(rig.ok());
      CaptureOptions options = default_options();
      options.rule->flood_fraction = options.rule->empty_fraction = tolerance;
      const auto result = capture(**rig, options);
      ASSERT_TRUE(result.ok());
      const auto errors = evaluate(
          result->tensor, [&](const Image<float>& p) -> Result<Image<float>> { return (*scene)->apply(p); });
      EXPECT_LE(errors->indirect, before) << "seed " << seed << ", tolerance " << tolerance;
      before = errors->indirect;
    }
  }
}

}  // namespace

}  // namespace symrig::finer_tolerance_test

namespace symrig::not_sparse_accuracy_test {

// Transport that is not data-sparse, of many kinds and grids: photographs and errors stay within their
// bounds.

namespace {

using namespace tests;

/// Of photographs that a search took before brute force went on: those that tell nothing new. The last level
/// spans the levels before it and the flood-lit photograph, and one half of the checks the other.
double told_twice(const Undetermined& found) {
  constexpr std::int64_t kOwnChecks = 5;
  return static_cast<double>(found.patterns - found.levels.back().patterns - kOwnChecks);
}

TEST(NotSparse, a_flat_spectrum_takes_no_more_photographs_than_brute_force) {
  // d photographs that tell nothing new leave T unknown on d directions with themselves, d² of n² numbers, of
  // a transport that has the same energy in all: a relative error of d / n. It scatters by 1 / √(2 · 21) = 15
  // % for d = 6 (21 numbers): 1.5 is three deviations.
  const DenseTransport small = transport({10, 11}, flat_spectrum(110, 3));
  const DenseTransport large = transport({32, 32}, positive_semidefinite(1024, 5));
  for (const DenseTransport* scene : {&small, &large}) {
    const auto pixels = static_cast<double>(scene->grid().size());
    const Outcome outcome = run(*scene);
    EXPECT_LE(outcome.result.patterns, scene->grid().size());
    ASSERT_TRUE(outcome.result.undetermined);
    const Undetermined& found = *outcome.result.undetermined;
    EXPECT_TRUE(found.completed);
    EXPECT_GT(found.forecast, found.brute_force);
    EXPECT_EQ(found.brute_force, scene->grid().size());
    EXPECT_EQ(found.levels.back().leaves, 0);
    EXPECT_GT(found.levels.back().unexplained, 0.75);
    EXPECT_LE(outcome.error, 1.5 * told_twice(found) / pixels);
    ASSERT_TRUE(outcome.result.estimated);
    EXPECT_LE(outcome.error,
              outcome.result.estimated->frobenius + outcome.result.estimated_half_width.frobenius);
    EXPECT_TRUE(outcome.result.held_out.empty());  // they went into the tensor
  }
}

TEST(NotSparse, positive_light_without_structure_is_not_taken_for_smooth_light) {
  // Numbers between 0 and 1 scatter by 1 / √24 where both halves of T are averaged, around 1 / 2: at most
  // this share of T is left where photographs tell nothing.
  const double scatter = std::sqrt(1.0 / 24) / std::sqrt(1.0 / 4 + 1.0 / 24);
  for (const Grid grid : {Grid{10, 11}, Grid{32, 32}}) {
    const auto pixels = static_cast<int>(grid.size());
    const Outcome outcome = run(transport(grid, positive(pixels, 7)));
    EXPECT_LE(outcome.result.patterns, pixels);
    ASSERT_TRUE(outcome.result.undetermined) << pixels;
    const auto before = static_cast<double>(outcome.result.undetermined->patterns);
    EXPECT_LE(outcome.error, scatter * before / pixels) << pixels;
  }
}

TEST(NotSparse, a_checkerboard_is_found_by_the_held_out_photographs) {
  // Of T = t (a a' + b b'), a and b the two colours, what m photographs leave to the prior is at most what
  // lies between m pixels: t m of ‖T‖ = t n / √2.
  for (const int side : {8, 16, 17, 24, 32}) {
    const Outcome outcome = run(checkerboard(side));
    EXPECT_LE(outcome.result.patterns, side * side);
    ASSERT_TRUE(outcome.result.undetermined) << side;
    const auto before = static_cast<double>(outcome.result.undetermined->patterns);
    EXPECT_LE(outcome.error, std::numbers::sqrt2 * before / (side * side)) << side;
    EXPECT_LE(outcome.error,
              outcome.result.estimated->frobenius + outcome.result.estimated_half_width.frobenius);
  }
}

// Scenes with little but direct light: what goes between pixels looks wrong, or like noise, and is less than
// a twentieth of all light. Brute force would take 16,384 photographs for it.
TEST(NotSparse, little_light_is_no_reason_for_brute_force) {
  for (const auto& [scene, tolerance] : {std::pair{"sim:random?seed=3&size=128x128", 3e-4},
                                         std::pair{"sim:random?seed=8&size=128x128", 1.2e-3}}) {
    const auto rig = open_virtual_rig(scene);
    ASSERT_TRUE(rig.ok());
    CaptureOptions options;
    options.tolerance = tolerance;
    const auto result = capture(**rig, options);
    ASSERT_TRUE(result.ok());
    EXPECT_FALSE(result->undetermined) << scene;
    const Scene& truth = (*rig)->truth();
    const auto error = evaluate(
        result->tensor, [&](const Image<float>& p) -> Result<Image<float>> { return truth.apply(p); });
    ASSERT_TRUE(error.ok());
    EXPECT_LT(error->frobenius, 0.05) << scene;
  }
}

TEST(NotSparse, no_grid_takes_more_photographs_than_it_has_pixels) {
  for (const Grid grid : {Grid{1, 1}, Grid{1, 7}, Grid{2, 3}, Grid{7, 9}, Grid{8, 8}, Grid{1, 64},
                          Grid{65, 1}, Grid{5, 13}, Grid{9, 11}, Grid{13, 17}, Grid{16, 16}})
    for (const double sigma : {0.0, 1e-3}) {
      const CaptureOptions options{.unchecked = true};  // a single pixel may be black
      const auto pixels = static_cast<int>(grid.size());
      EXPECT_LE(run(facing_planes(grid), options, sigma).result.patterns, pixels) << to_string(grid);
      EXPECT_LE(run(transport(grid, gaussian(pixels, 11)), options, sigma).result.patterns, pixels)
          << to_string(grid);
      EXPECT_LE(run(transport(grid, positive(pixels, 12)), options, sigma).result.patterns, pixels)
          << to_string(grid);
      EXPECT_LE(run(transport(grid, pairs(pixels, 13)), options, sigma).result.patterns, pixels)
          << to_string(grid);
    }
}

}  // namespace

}  // namespace symrig::not_sparse_accuracy_test

namespace symrig::planned_exposures_test {

// Captures on rigs that plan their exposures.

namespace {

Result<TransportErrors> errors_of(const std::string& uri) {
  SYMRIG_TRY(const auto rig, open_virtual_rig(uri));
  CaptureOptions options;
  options.rule = default_rule(options.algorithm);
  options.economy = default_economy(options.algorithm);
  options.rule->flood_fraction = options.rule->empty_fraction = 1e-7;
  options.exposure.longest_seconds = 60;
  SYMRIG_TRY(const CaptureResult result, capture(*rig, options));
  const Scene& scene = rig->truth();
  return evaluate(result.tensor,
                  [&](const Image<float>& p) -> Result<Image<float>> { return scene.apply(p); });
}

// Indirect light at 1e-4 of the direct: 0.10 is what planning is for. With four exposures all of it drowns in
// the read noise of the longest one. The first level must not take the dark for brighter than it is:
// vgroove-white, all of whose indirect light goes far, was then found empty.
TEST(PlannedExposures, find_indirect_light_at_one_in_ten_thousand) {
  for (const std::string scene : {"gummy", "vgroove-white"}) {
    const std::string uri = "sim:" + scene + "?size=32x32&indirect=1e-4&black=0";
    const auto planned = errors_of(uri + "&exposures=auto");
    ASSERT_TRUE(planned.ok()) << planned.error().line();
    EXPECT_LE(planned->indirect, 0.10) << scene;
    const auto fixed = errors_of(uri + "&exposures=4");
    ASSERT_TRUE(fixed.ok()) << fixed.error().line();
    EXPECT_GT(fixed->indirect, 0.20) << scene;
  }
}

struct WithinSeconds {
  double rig_seconds = 0;
  double indirect = 0;
};

/// A capture of vgroove-textured, with a tolerance and a budget of seconds; 0: none.
WithinSeconds capture_within(double coarser, double max_seconds) {
  const auto rig = open_virtual_rig("sim:vgroove-textured?size=32x32&exposures=auto");
  EXPECT_TRUE(rig.ok());
  CaptureOptions options;
  options.tolerance = coarser * default_rule(options.algorithm).flood_fraction;
  options.max_seconds = max_seconds;
  const auto result = capture(**rig, options);
  EXPECT_TRUE(result.ok());
  const Scene& scene = (*rig)->truth();
  const auto errors =
      evaluate(result->tensor, [&](const Image<float>& p) -> Result<Image<float>> { return scene.apply(p); });
  return {(*rig)->cost().rig_seconds, errors->indirect};
}

// As Budget.a_budget_does_about_what_the_best_coarser_tolerance_does: two steps more than the best tolerance
// that takes as many seconds. Without shorter exposures, the same seconds take too few photographs.
TEST(PlannedExposures, a_budget_of_seconds_does_about_what_the_best_coarser_tolerance_does) {
  constexpr int kSteps = 12;
  std::vector<WithinSeconds> coarser;
  coarser.reserve(kSteps);
  for (int steps = 0; steps < kSteps; ++steps) coarser.push_back(capture_within(std::pow(1.5, steps), 0));
  for (const double share : {0.5, 0.7}) {
    const double seconds = share * coarser.front().rig_seconds;
    const WithinSeconds bound = capture_within(1, seconds);
    double best = 1;
    for (const WithinSeconds& one : coarser)
      if (one.rig_seconds <= seconds) best = std::min(best, one.indirect);
    EXPECT_LE(bound.rig_seconds, seconds) << share;
    EXPECT_LE(bound.indirect, 1.5 * 1.5 * best) << share << ": " << best;
  }
}

}  // namespace

}  // namespace symrig::planned_exposures_test
