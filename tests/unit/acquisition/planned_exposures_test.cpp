// SPDX-License-Identifier: Apache-2.0
// Captures on rigs that plan their exposures.
#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/sim/scene.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <string>

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

}  // namespace
}  // namespace symrig::planned_exposures_test
