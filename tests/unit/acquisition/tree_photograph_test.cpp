// SPDX-License-Identifier: Apache-2.0
#include "acquisition/tree/tree_photograph.hpp"

#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::acquisition::tree_photograph_test {
namespace {

constexpr Grid kGrid{5, 7};
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kLargest = std::numeric_limits<float>::max();

Radiance photograph(int channels) {
  Radiance p{Image<float>(kGrid, channels), Image<float>(kGrid, channels),
             Image<std::uint8_t>(kGrid, channels, std::uint8_t{1})};
  float next = -40;
  for (float& v : p.mean.values()) v = next++;
  for (float& v : p.variance.values()) v = next++ / 8;
  for (float& v : p.variance.values()) v = v < 0 ? -v : v;
  return p;
}

TEST(TreePhotograph, every_channel_is_put_into_tree_order) {
  const BlockTree tree(kGrid);
  const Radiance from = photograph(3);
  TreePhotograph to;
  ASSERT_TRUE(to_tree(tree, from, to));
  for (std::size_t channel = 0; channel < 3; ++channel)
    for (std::size_t t = 0; t < 35; ++t) {
      const std::size_t raster = tree.order()[t];
      EXPECT_EQ(to.mean[channel * 35 + t], from.mean.values()[channel * 35 + raster]);
      EXPECT_EQ(to.variance[channel * 35 + t], from.variance.values()[channel * 35 + raster]);
      EXPECT_EQ(to.valid[channel * 35 + t], 1);
    }
}

TEST(TreePhotograph, what_is_not_valid_becomes_zero_whatever_it_is) {
  const BlockTree tree(kGrid);
  Radiance from = photograph(1);
  from.valid.values()[9] = from.valid.values()[34] = 0;
  from.mean.values()[9] = kNan;
  from.variance.values()[34] = -1;
  TreePhotograph to;
  ASSERT_TRUE(to_tree(tree, from, to));
  for (std::size_t t = 0; t < 35; ++t) {
    const std::size_t raster = tree.order()[t];
    const bool valid = raster != 9 && raster != 34;
    EXPECT_EQ(to.valid[t], valid ? 1 : 0);
    EXPECT_EQ(to.mean[t], valid ? from.mean.values()[raster] : 0);
    EXPECT_EQ(to.variance[t], valid ? from.variance.values()[raster] : 0);
  }
}

TEST(TreePhotograph, valid_samples_must_be_finite_and_their_variance_not_negative) {
  const BlockTree tree(kGrid);
  TreePhotograph to;
  const auto accepted = [&](float mean, float variance) {
    Radiance from = photograph(2);
    from.mean.plane(1)[20] = mean;
    from.variance.plane(1)[20] = variance;
    return to_tree(tree, from, to);
  };
  for (const float mean : {0.0F, -0.0F, -1.0F, kLargest, -kLargest, std::numeric_limits<float>::denorm_min()})
    EXPECT_TRUE(accepted(mean, 1)) << mean;
  for (const float variance : {0.0F, -0.0F, kLargest, std::numeric_limits<float>::denorm_min()})
    EXPECT_TRUE(accepted(1, variance)) << variance;
  for (const float bad : {kNan, -kNan, kInfinity, -kInfinity}) {
    EXPECT_FALSE(accepted(bad, 1)) << bad;
    EXPECT_FALSE(accepted(1, bad)) << bad;
  }
  for (const float negative : {-1.0F, -kLargest, -std::numeric_limits<float>::denorm_min()})
    EXPECT_FALSE(accepted(1, negative)) << negative;
}

}  // namespace
}  // namespace symrig::acquisition::tree_photograph_test
