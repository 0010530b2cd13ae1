// SPDX-License-Identifier: Apache-2.0
#include "sim/camera_optics.hpp"

#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

namespace symrig::sim::camera_optics_test {
namespace {

TEST(Shift, moves_a_picture_by_whole_and_part_pixels) {
  Image<float> picture({5, 6});
  picture.at(2, 3) = 1;
  Image<float> whole = picture;
  shift(whole.grid(), 1, whole.plane(0));
  EXPECT_EQ(whole.at(1, 2), 1.F);
  Image<float> part = picture;
  shift(part.grid(), 0.25, part.plane(0));  // samples at 2.25 see three quarters of pixel 2
  EXPECT_FLOAT_EQ(part.at(2, 3), 0.75F * 0.75F);
  EXPECT_FLOAT_EQ(part.at(1, 2), 0.25F * 0.25F);
  EXPECT_FLOAT_EQ(part.at(1, 3), 0.25F * 0.75F);
  Image<float> back = picture;
  shift(back.grid(), -0.5, back.plane(0));
  EXPECT_FLOAT_EQ(back.at(3, 4), 0.25F);
}

TEST(Flare, spreads_to_one_side_and_adds_no_light) {
  Image<float> picture({40, 30});
  picture.at(10, 8) = 1;
  add_flare(picture.grid(), 0.2, picture.plane(0));
  const double total = std::accumulate(picture.values().begin(), picture.values().end(), 0.0);
  EXPECT_LE(total, 1 + 1e-6);
  EXPECT_GT(total, 0.95);
  EXPECT_NEAR(picture.at(10, 8), 0.8 + 0.2 * std::pow(1 - std::exp(-0.25), 2), 1e-6);
  EXPECT_GT(picture.at(12, 9), 0);
  EXPECT_EQ(picture.at(9, 8), 0);
  EXPECT_EQ(picture.at(10, 7), 0);
}

// Binomial: 5 sigmas of 40,000 draws at 1 %.
TEST(DeadPixels, have_the_share_asked_for) {
  const auto dead = dead_pixels({200, 200}, 0.01, 3);
  const int count = std::accumulate(dead.values().begin(), dead.values().end(), 0);
  EXPECT_NEAR(count, 400, 5 * std::sqrt(400 * 0.99));
  EXPECT_EQ(dead, dead_pixels({200, 200}, 0.01, 3));
  EXPECT_NE(dead, dead_pixels({200, 200}, 0.01, 4));
  EXPECT_TRUE(dead_pixels({200, 200}, 0, 3).empty());
}

}  // namespace
}  // namespace symrig::sim::camera_optics_test
