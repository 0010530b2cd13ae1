// SPDX-License-Identifier: Apache-2.0
// Captures on rigs that plan their exposures.
#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/sim/scene.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::planned_exposures_test {
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
