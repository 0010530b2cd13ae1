// SPDX-License-Identifier: Apache-2.0
// Noise that is not as a probe promises: told when gross, and never where it is as promised.
#include "spoiled_capture.hpp"
#include "symrig/acquisition/error_estimate.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace symrig::noise_check_test {
namespace {

using tests::check_of;
using tests::tells;

TEST(NoiseCheck, a_lamp_that_flickers_slowly_is_told) {
  const NoiseCheck check = check_of([](Radiance& answer, int photograph) {
    const auto level = static_cast<float>(1 + 0.03 * std::sin(0.05 * photograph));
    for (float& v : answer.mean.values()) v *= level;
  });
  EXPECT_TRUE(tells(check, "light changed"));
}

TEST(NoiseCheck, photographs_without_a_variance_must_have_no_noise) {
  const NoiseCheck check = check_of(
      [](Radiance& answer, int) {
        for (float& v : answer.variance.values()) v = 0;
      },
      0.01);
  EXPECT_TRUE(tells(check, "state no noise"));
}

}  // namespace
}  // namespace symrig::noise_check_test
