// SPDX-License-Identifier: Apache-2.0
#include "acquisition/tree/tree_photograph.hpp"

#include "symrig/base/statistics.hpp"
#include "symrig/tensor/block_tree.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
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

namespace symrig::residual_shift_test {

// What is not known of where photographs look becomes variance.

namespace {

using acquisition::add_shift_variance;
using acquisition::TreePhotograph;

constexpr double kSigma = 0.04;

Image<float> texture(Grid grid, int channels) {
  Image<float> mean(grid, channels);
  Random random(3);
  for (float& v : mean.values()) v = static_cast<float>(random.uniform());
  return mean;
}

TreePhotograph photograph_of(const BlockTree& tree, const Image<float>& mean) {
  TreePhotograph photograph;
  EXPECT_TRUE(to_tree(tree,
                      {mean, Image<float>(mean.grid(), mean.channels()),
                       Image<std::uint8_t>(mean.grid(), mean.channels(), std::uint8_t{1})},
                      photograph));
  return photograph;
}

/// The mean over both signs of the squared change of a picture that is shifted by sigma along each axis.
/// Pixels beyond the edge are as the edge.
double squared_change(const Image<float>& p, int row, int col, int channel, double sigma) {
  const Grid grid = p.grid();
  const auto at = [&](int r, int c) {
    return static_cast<double>(
        p.at(std::clamp(r, 0, grid.rows - 1), std::clamp(c, 0, grid.cols - 1), channel));
  };
  double sum = 0;
  for (const auto& [down, right] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}})
    sum += std::pow(sigma * (at(row + down, col + right) - at(row, col)), 2);
  return sum / 2;  // of the two signs; the axes add up
}

TEST(ResidualShift, is_the_squared_change_of_a_shifted_picture) {
  const Grid grid{7, 9};
  const BlockTree tree(grid);
  const Image<float> mean = texture(grid, 2);
  TreePhotograph photograph = photograph_of(tree, mean);
  const PagedVector<float> before = photograph.mean;
  photograph.variance.assign(photograph.variance.size(), 1e-4F);
  add_shift_variance(tree, kSigma, {&photograph, 1});
  EXPECT_EQ(photograph.mean, before);
  for (int c = 0; c < 2; ++c)
    for (std::size_t t = 0; t < tree.order().size(); ++t) {
      const int row = tree.order()[t] / grid.cols, col = tree.order()[t] % grid.cols;
      const double expected = 1e-4 + squared_change(mean, row, col, c, kSigma);
      // Some roundings in float.
      EXPECT_NEAR(static_cast<double>(photograph.variance[c * tree.order().size() + t]), expected,
                  1e-6 * expected)
          << row << " " << col << " " << c;
    }
}

TEST(ResidualShift, leaves_out_pixels_that_are_not_valid) {
  const BlockTree tree(Grid{3, 3});
  Image<float> mean({3, 3}, 1, 1.F);
  mean.at(1, 1) = 100;
  TreePhotograph photograph = photograph_of(tree, mean);
  const auto centre = std::ranges::find(photograph.mean, 100.F) - photograph.mean.begin();
  photograph.valid[static_cast<std::size_t>(centre)] = 0;
  add_shift_variance(tree, kSigma, {&photograph, 1});
  for (const float v : photograph.variance) EXPECT_EQ(v, 0);
}

TEST(ResidualShift, nothing_crosses_from_view_to_view) {
  const auto tree =
      BlockTree::make({4, 6}, {.views = {1, 2}, .order = SplitOrder::views_first, .surface = {}});
  ASSERT_TRUE(tree.ok()) << tree.error().line();
  Image<float> mean({4, 6}, 1);
  for (int row = 0; row < 4; ++row)
    for (int col = 3; col < 6; ++col) mean.at(row, col) = 1;
  TreePhotograph photograph = photograph_of(*tree, mean);
  add_shift_variance(*tree, kSigma, {&photograph, 1});
  for (const float v : photograph.variance) EXPECT_EQ(v, 0);
}

TEST(ResidualShift, an_exact_map_adds_nothing) {
  const BlockTree tree(Grid{5, 5});
  TreePhotograph photograph = photograph_of(tree, texture({5, 5}, 1));
  add_shift_variance(tree, 0, {&photograph, 1});
  for (const float v : photograph.variance) EXPECT_EQ(v, 0);
}

}  // namespace

}  // namespace symrig::residual_shift_test
