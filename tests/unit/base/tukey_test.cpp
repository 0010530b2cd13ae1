// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/tukey.hpp"

#include <limits>

#include <gtest/gtest.h>

namespace symrig::tukey_test {
namespace {

TEST(Tukey, counts_less_the_farther_a_residual_is) {
  EXPECT_EQ(tukey_weight(0), 1);
  EXPECT_DOUBLE_EQ(tukey_weight(kTukeyReach / 2), 0.5625);
  EXPECT_DOUBLE_EQ(tukey_weight(-kTukeyReach / 2), 0.5625);
}

TEST(Tukey, beyond_its_reach_nothing_counts) {
  EXPECT_EQ(tukey_weight(kTukeyReach), 0);
  EXPECT_EQ(tukey_weight(-1e9), 0);
  EXPECT_EQ(tukey_weight(std::numeric_limits<double>::infinity()), 0);
}

}  // namespace
}  // namespace symrig::tukey_test
