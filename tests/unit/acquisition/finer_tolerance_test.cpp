// SPDX-License-Identifier: Apache-2.0
// A finer tolerance on a noisy scene costs photographs, not accuracy.
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/sim/scene.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "workbench.hpp"

#include <string>

#include <gtest/gtest.h>

namespace symrig::finer_tolerance_test {
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
