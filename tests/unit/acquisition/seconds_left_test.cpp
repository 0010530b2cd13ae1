// SPDX-License-Identifier: Apache-2.0
#include "acquisition/tree/seconds_left.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace symrig::acquisition {
namespace {

/// Steps of an eighth of an octave round down by so much at most.
const double kRounded = std::exp2(-1.0 / 8) - 1e-9;

TEST(SecondsLeft, limits_nothing_without_a_budget) {
  SecondsLeft left;
  left.begin(3);
  EXPECT_FALSE(left.limited());
  EXPECT_TRUE(std::isinf(left.each(3, 0, 7).photograph));
  EXPECT_TRUE(std::isinf(left.each(3, 0, 7).black));
  EXPECT_EQ(left.together(3, 32), 32U);
  EXPECT_EQ(left.room(1e9, 32, 1, true), 32U);
}

TEST(SecondsLeft, deals_a_share_of_what_is_left) {
  SecondsLeft left;
  left.end_by(100);
  left.may_spend(0.25);
  left.begin(20);  // 20 of the 80 seconds
  const double each = left.each(20, 0, 10).photograph;
  EXPECT_LE(each, 2);
  EXPECT_GE(each, kRounded * 2);
  EXPECT_LE(left.each(20, 10, 10).photograph, 1) << "10 s are reserved";
  EXPECT_LE(left.each(120, 0, 10).photograph, 1e-3) << "nothing is left";
}

TEST(SecondsLeft, learns_what_photographs_take_beyond_their_plan) {
  SecondsLeft left;
  left.end_by(100);
  left.begin(0);
  const double before = left.each(0, 0, 100).photograph;
  left.took(4 * (before + 0.2), 4, before);
  const double after = left.each(0, 0, 100).photograph;
  EXPECT_LE(after, 1 - 0.2);
  EXPECT_GE(after, kRounded * (1 - 0.2));
}

TEST(SecondsLeft, has_room_for_what_surely_ends_in_time) {
  SecondsLeft left;
  left.end_by(10);
  left.begin(0);
  EXPECT_EQ(left.room(0, 8, 2, true), 4U) << "the plan is all that is known";
  left.took(4, 4, 2);
  EXPECT_EQ(left.room(4, 8, 2, true), 5U) << "each took a second";
  EXPECT_EQ(left.room(10, 8, 2, true), 0U);
  left.begin(5);
  EXPECT_EQ(left.room(5, 8, 2, false), 4U) << "fixed exposures take as long as before";
  EXPECT_LT(left.together(9.5, 32), 8U) << "near the end, the clock is looked at often";
}

}  // namespace
}  // namespace symrig::acquisition
