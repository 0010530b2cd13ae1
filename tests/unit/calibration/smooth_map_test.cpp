// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/pixel_map.hpp"
#include "synthetic_photographs.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace symrig::smooth_map_test {
namespace {

constexpr Grid kCamera{200, 240};
constexpr int kEdge = 121;  // the first column of the second plane; no border of blocks
constexpr double kNoise = 0.13;

/// Two planes that part by `step` projector pixels at kEdge, decoded with noise.
PixelMap two_planes(double step, double noise) {
  PixelMap map{.camera = kCamera,
               .projector = {300, 300},
               .col = Image<float>(kCamera),
               .row = Image<float>(kCamera),
               .mask = Image<std::uint8_t>(kCamera, 1, 1),
               .col_sigma = Image<float>(kCamera, 1, static_cast<float>(kNoise)),
               .row_sigma = Image<float>(kCamera, 1, static_cast<float>(kNoise)),
               .contrast = Image<float>(kCamera, 1, 1)};
  std::uint64_t counter = 1;
  for (int r = 0; r < kCamera.rows; ++r)
    for (int c = 0; c < kCamera.cols; ++c) {
      const double col = 20 + 0.62 * c + 0.05 * r + (c < kEdge ? 0 : step), row = 10 + 0.6 * r - 0.03 * c;
      map.col.at(r, c) = static_cast<float>(col + noise * test::normal(counter));
      map.row.at(r, c) = static_cast<float>(row + noise * test::normal(counter));
    }
  return map;
}

double marked(const SmoothMap& smooth, int first_col, int end_col) {
  double sum = 0;
  for (int r = 0; r < kCamera.rows; ++r)
    for (int c = first_col; c < end_col; ++c) sum += smooth.edges.at(r, c);
  return sum / (kCamera.rows * (end_col - first_col));
}

// A step of six projector pixels. Every block that contains it, and no pixel further than a block from it, is
// marked, in all rows but those near the corners, where blocks have too few neighbours to tell.
TEST(SmoothMap, MarksADepthStepAndNothingElse) {
  const auto smooth = fit_smooth_map(two_planes(6, kNoise));
  ASSERT_TRUE(smooth.ok()) << smooth.error().line();
  EXPECT_EQ(smooth->pieces, 2);
  EXPECT_GT(marked(*smooth, 120, 124), 0.9);
  EXPECT_EQ(marked(*smooth, 0, 108), 0);
  EXPECT_EQ(marked(*smooth, 136, kCamera.cols), 0);
}

// Held-out pixels have their own noise, which no model predicts. The error of the model adds to it: at most
// 40 coefficients an axis and piece for 24,000 pixels, a share of 0.002 of the variance. With 10,000 judged
// pixels, the rms itself is uncertain by 1 / √40,000; five sigmas are 2.5 %.
TEST(SmoothMap, PredictsHeldOutPixelsToTheirNoise) {
  const auto smooth = fit_smooth_map(two_planes(6, kNoise));
  ASSERT_TRUE(smooth.ok()) << smooth.error().line();
  EXPECT_GT(smooth->held_out.planar_share, 0.5);
  EXPECT_NEAR(smooth->held_out.rms, kNoise, 0.03 * kNoise);
  EXPECT_EQ(smooth->held_out.far_share, 0);
}

// A model that followed the noise would err by more than that.
TEST(SmoothMap, HasOnePieceAndNoEdgeOnOnePlane) {
  const PixelMap map = two_planes(0, kNoise);
  const auto smooth = fit_smooth_map(map);
  ASSERT_TRUE(smooth.ok()) << smooth.error().line();
  EXPECT_EQ(smooth->pieces, 1);
  EXPECT_EQ(smooth->edge_share, 0);
  EXPECT_GT(smooth->known_share, 0.999);
  double squares = 0;
  for (int r = 0; r < kCamera.rows; ++r)
    for (int c = 0; c < kCamera.cols; ++c)
      squares += std::pow(static_cast<double>(smooth->col.at(r, c)) - (20 + 0.62 * c + 0.05 * r), 2);
  EXPECT_LT(std::sqrt(squares / static_cast<double>(kCamera.size())), 0.1 * kNoise);
}

// Only rounding is left: positions of 32 bits below 256 are multiples of 2⁻¹⁶.
TEST(SmoothMap, FitsExactPlanes) {
  const auto smooth = fit_smooth_map(two_planes(6, 0));
  ASSERT_TRUE(smooth.ok()) << smooth.error().line();
  EXPECT_EQ(smooth->pieces, 2);
  EXPECT_LT(smooth->held_out.rms, 1e-4);
}

// The pixels that judge are not used: wrong positions there change the rms, but neither the model of the
// others nor which pixels are judged.
TEST(SmoothMap, JudgesByPixelsThatItDoesNotUse) {
  PixelMap map = two_planes(6, kNoise);
  const auto before = fit_smooth_map(map);
  ASSERT_TRUE(before.ok());
  for (int r = 0; r < kCamera.rows; ++r)
    for (int c = 0; c < kCamera.cols; ++c)
      if ((r / 4 + c / 4) % 2 != 0) map.col.at(r, c) += 2;
  const auto after = fit_smooth_map(map);
  ASSERT_TRUE(after.ok());
  EXPECT_EQ(after->held_out.planar_share, before->held_out.planar_share);
  const double squares = std::pow(after->held_out.rms, 2) - std::pow(before->held_out.rms, 2);
  // Σ ((e + 2)² − e²) / 2 over 10,000 pixels and more: 2² / 2, and 2 e, whose mean is known to 0.13 / 100.
  // That is 0.0026; with the model's own error, five of it.
  EXPECT_NEAR(squares, 2, 0.02);
}

TEST(SmoothMap, RefusesAnEmptyMap) {
  PixelMap map = two_planes(0, kNoise);
  map.mask = Image<std::uint8_t>(kCamera);
  const auto smooth = fit_smooth_map(map);
  ASSERT_FALSE(smooth.ok());
  EXPECT_EQ(smooth.error().code, ErrorCode::bad_value);
}

}  // namespace
}  // namespace symrig::smooth_map_test
