// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/pixel_map.hpp"
#include "synthetic_photographs.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace symrig::decode_test {
namespace {

using test::SyntheticScene;

/// How a map compares with the known one, over pixels that see the projector directly, away from its border.
struct MapError {
  double rms = 0;             // of decoded pixels, both axes [projector pixels]
  double within_a_pixel = 0;  // share of the decoded
  double decoded = 0;         // share of the lit
};

MapError compare(const PixelMap& map, const SyntheticScene& scene) {
  MapError error;
  double lit = 0, decoded = 0;
  for (int r = 0; r < scene.camera.rows; ++r) {
    for (int c = 0; c < scene.camera.cols; ++c) {
      const double col = scene.col(r, c), row = SyntheticScene::row(r, c);
      if (SyntheticScene::shadow(r, c) || col < 2 || col > scene.projector.cols - 3 || row < 2 ||
          row > scene.projector.rows - 3)
        continue;
      lit += 1;
      if (!map.mask.at(r, c)) continue;
      decoded += 1;
      const double dx = static_cast<double>(map.col.at(r, c)) - col,
                   dy = static_cast<double>(map.row.at(r, c)) - row;
      error.rms += (dx * dx + dy * dy) / 2;
      error.within_a_pixel += std::max(std::abs(dx), std::abs(dy)) < 1 ? 1 : 0;
    }
  }
  return {std::sqrt(error.rms / decoded), error.within_a_pixel / decoded, decoded / lit};
}

double decoded_in_shadow(const PixelMap& map, const SyntheticScene& scene) {
  double shadow = 0, decoded = 0;
  for (int r = 0; r < scene.camera.rows; ++r)
    for (int c = 0; c < scene.camera.cols; ++c)
      if (SyntheticScene::shadow(r, c)) shadow += 1, decoded += map.mask.at(r, c);
  return decoded / shadow;
}

TEST(Decode, PositionsLieBetweenPixels) {
  // Noise: 0.004 √2 a difference, direct light 0.38 or more, so that at the steepest (1.2 a pixel) a position
  // is known to 0.012 px. The rest is the footprint's shape: the scene's is sampled at 9 × 9 points of a grid
  // 0.42 px apart, each rounded to a whole pixel, which moves an edge by up to 0.1 px.
  const SyntheticScene scene;
  const auto map = decode(test::default_photographs());
  ASSERT_TRUE(map.ok()) << map.error().line();
  const MapError error = compare(*map, scene);
  EXPECT_LE(error.rms, 0.10);
  EXPECT_GT(error.rms, 0.001);
  EXPECT_GE(error.within_a_pixel, 0.999);
  EXPECT_GE(error.decoded, 0.99);
}

TEST(Decode, ShadowIsLeftOut) {
  const SyntheticScene scene;
  const auto map = decode(test::default_photographs());
  ASSERT_TRUE(map.ok());
  EXPECT_LE(decoded_in_shadow(*map, scene), 0.05);  // its rim may be reached from the lit side
}

TEST(Decode, NoiseIsEstimated) {
  // Noise of 0.004 and rounding to 1/255 (rms 1/255/√12 = 0.00113).
  const auto map = decode(test::default_photographs());
  ASSERT_TRUE(map.ok());
  EXPECT_NEAR(map->noise, std::hypot(0.004, 0.00113), 0.1 * 0.004);
}

TEST(Decode, StrongNoiseCostsPixelsNotCorrectness) {
  SyntheticScene scene;
  scene.noise = 0.03;
  const auto map = decode(test::photograph_sequence(scene));
  ASSERT_TRUE(map.ok());
  const MapError error = compare(*map, scene);
  EXPECT_GE(error.within_a_pixel, 0.99);
  EXPECT_GE(error.decoded, 0.5);
}

class DecodeWithoutAPair : public testing::TestWithParam<int> {};

TEST_P(DecodeWithoutAPair, FindsThePositionsFromOrientation) {
  const SyntheticScene scene;
  const auto& photographs = test::default_photographs();
  const auto map = decode(photographs, {.held_out_pair = GetParam()});
  ASSERT_TRUE(map.ok()) << map.error().line();
  const MapError error = compare(*map, scene);
  EXPECT_GE(error.within_a_pixel, 0.995);
  EXPECT_GE(error.decoded, 0.95);
}

TEST_P(DecodeWithoutAPair, NeverLooksAtIt) {
  auto photographs = test::default_photographs();
  const auto before = decode(photographs, {.held_out_pair = GetParam()});
  for (int complement = 0; complement < 2; ++complement)
    for (float& v : photographs.images[2 * GetParam() + complement].values()) v = 1e6F;
  const auto after = decode(photographs, {.held_out_pair = GetParam()});
  ASSERT_TRUE(before.ok() && after.ok());
  EXPECT_EQ(before->col, after->col);
  EXPECT_EQ(before->row, after->row);
  EXPECT_EQ(before->mask, after->mask);
  EXPECT_EQ(before->noise, after->noise);
}
// Pairs with stripes of at least 16 px, 27 camera pixels: bits 0 to 3 of 7 columns, of 7 rows.
INSTANTIATE_TEST_SUITE_P(Pairs, DecodeWithoutAPair, testing::Values(0, 1, 2, 3, 7, 8, 9, 10));

TEST(Decode, MirroredProjectionNeedsItsOption) {
  SyntheticScene scene;
  scene.mirrored = true;
  const auto photographs = test::photograph_sequence(scene);
  const auto refused = decode(photographs);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::bad_value);
  const auto map = decode(photographs, {.mirrored = true, .held_out_pair = 1});
  ASSERT_TRUE(map.ok()) << map.error().line();
  EXPECT_GE(compare(*map, scene).within_a_pixel, 0.995);
}

TEST(Decode, RefusesAPairThatIsNone) {
  const auto& photographs = test::default_photographs();
  EXPECT_EQ(decode(photographs, {.held_out_pair = 14}).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(decode(photographs, {.held_out_pair = -1}).error().code, ErrorCode::bad_argument);
}

TEST(Decode, RefusesADarkRoom) {
  auto photographs = test::default_photographs();
  for (auto& image : photographs.images)
    std::ranges::copy(photographs.black().values(), image.values().begin());
  photographs.images[photographs.code.white()].values()[0] += 0.001F;
  EXPECT_EQ(decode(photographs).error().code, ErrorCode::bad_value);
}

}  // namespace
}  // namespace symrig::decode_test
