// SPDX-License-Identifier: Apache-2.0
// Colour mosaics, and what renormalising to the flood-lit photograph is worth on single-pixel patterns.
#include "symrig/hdr/mosaic.hpp"

#include "simulated_sensor.hpp"

#include <gtest/gtest.h>

namespace symrig::mosaic_test {
namespace {

constexpr Grid kGrid{16, 20};

/// A scene whose transport is diagonal: each pixel sends its own light back, in a colour of its own.
Image<float> coloured_scene() {
  test::Random random(1);
  Image<float> scene(kGrid, 3);
  for (int row = 0; row < kGrid.rows; ++row)
    for (int col = 0; col < kGrid.cols; ++col) {
      const double albedo = 0.2 + 0.8 * random.uniform();
      for (int c = 0; c < 3; ++c)
        scene.at(row, col, c) = static_cast<float>(albedo * (0.4 + 0.2 * c * col / kGrid.cols + 0.1 * c));
    }
  return scene;
}

/// The mosaic of a photograph in which only pixels of `lit` send light.
Radiance mosaic_of(const Image<float>& scene, const BayerPattern& bayer, const std::vector<char>& lit) {
  Radiance mosaic{Image<float>(kGrid), Image<float>(kGrid, 1, 1e-8F), Image<std::uint8_t>(kGrid, 1, 1)};
  for (int row = 0; row < kGrid.rows; ++row)
    for (int col = 0; col < kGrid.cols; ++col)
      if (lit[row * kGrid.cols + col] != 0) mosaic.mean.at(row, col) = scene.at(row, col, bayer.at(row, col));
  return mosaic;
}

std::vector<char> all_lit() {
  return std::vector<char>(kGrid.size(), 1);
}
std::vector<char> one_lit(int pixel) {
  std::vector<char> lit(kGrid.size());
  lit[pixel] = 1;
  return lit;
}

TEST(Mosaic, NamesAndPlaces) {
  const auto bayer = parse_bayer("GRBG");
  ASSERT_TRUE(bayer.ok());
  EXPECT_EQ(bayer->at(0, 0), 1);
  EXPECT_EQ(bayer->at(0, 1), 0);
  EXPECT_EQ(bayer->at(1, 0), 2);
  EXPECT_EQ(bayer->at(5, 3), 1);
  EXPECT_EQ(parse_bayer("RGBG").error().code, ErrorCode::unknown_name);
}

TEST(Mosaic, EvenLightIsDemosaicedExactly) {
  Image<float> even(kGrid, 3, 0.25F);
  const auto colours = demosaic(mosaic_of(even, {}, all_lit()), {});
  ASSERT_TRUE(colours.ok());
  for (const float v : colours->mean.values()) EXPECT_FLOAT_EQ(v, 0.25F);
  for (const float v : colours->variance.values()) EXPECT_LE(v, 1.0001e-8F);  // means of one to four samples
}

// What the paper saw: a single pixel is darker and loses its colour. The renormalised one keeps both.
TEST(Mosaic, RenormalisedSinglePixelsKeepTheirLightAndColour) {
  const Image<float> scene = coloured_scene();
  const BayerPattern bayer;
  const Radiance flood = mosaic_of(scene, bayer, all_lit());
  double plain = 0, renormalised = 0, truth = 0, stray_plain = 0, stray = 0;
  for (int pixel = 0; pixel < kGrid.size(); ++pixel) {
    const Radiance single = mosaic_of(scene, bayer, one_lit(pixel));
    const auto interpolated = demosaic(single, bayer);
    const auto coloured = colour_by_flood(single, flood, bayer);
    ASSERT_TRUE(interpolated.ok() && coloured.ok());
    for (int c = 0; c < 3; ++c)
      for (int i = 0; i < kGrid.size(); ++i) {
        const std::size_t at = i;
        const double true_light = i == pixel ? static_cast<double>(scene.plane(c)[at]) : 0;
        const double a = interpolated->mean.plane(c)[at], b = coloured->mean.plane(c)[at];
        truth += true_light * true_light;
        plain += (a - true_light) * (a - true_light);
        renormalised += (b - true_light) * (b - true_light);
        if (i != pixel) {
          stray_plain += std::abs(a);
          stray += std::abs(b);
        }
      }
  }
  RecordProperty("plain_error", std::to_string(std::sqrt(plain / truth)));
  RecordProperty("renormalised_error", std::to_string(std::sqrt(renormalised / truth)));
  EXPECT_EQ(stray, 0);
  EXPECT_GT(stray_plain, 0);
  EXPECT_LT(renormalised, 0.25 * plain);
}

TEST(Mosaic, PatternsThatAddUpToFloodLightAddUpToItsPhotograph) {
  const Image<float> scene = coloured_scene();
  const BayerPattern bayer{{1, 0, 2, 1}};
  const Radiance flood = mosaic_of(scene, bayer, all_lit());
  Image<float> sum(kGrid, 3);
  for (const int parity : {0, 1}) {
    std::vector<char> lit;
    lit.reserve(kGrid.size());
    for (int i = 0; i < kGrid.size(); ++i) lit.push_back(i / 3 % 2 == parity ? char{1} : char{0});
    const auto part = colour_by_flood(mosaic_of(scene, bayer, lit), flood, bayer);
    ASSERT_TRUE(part.ok());
    for (std::size_t i = 0; i < sum.values().size(); ++i) sum.values()[i] += part->mean.values()[i];
  }
  const auto whole = demosaic(flood, bayer);
  ASSERT_TRUE(whole.ok());
  for (int c = 0; c < 3; ++c)
    for (int row = 0; row < kGrid.rows; ++row)
      for (int col = 0; col < kGrid.cols; ++col) {
        const float expected =
            c == bayer.at(row, col) ? flood.mean.at(row, col) : whole->mean.at(row, col, c);
        EXPECT_NEAR(sum.at(row, col, c), expected, 4e-7 * expected);
      }
}

TEST(Mosaic, WhatTheFloodDoesNotShowIsInvalid) {
  const Image<float> scene = coloured_scene();
  Radiance flood = mosaic_of(scene, {}, all_lit());
  flood.valid.at(4, 4) = 0;
  flood.mean.at(8, 8) = 1e-5F;  // 0.1 σ
  const auto coloured = colour_by_flood(mosaic_of(scene, {}, all_lit()), flood, {});
  ASSERT_TRUE(coloured.ok());
  for (int c = 0; c < 3; ++c) {
    EXPECT_EQ(coloured->valid.at(4, 4, c), 0);
    EXPECT_EQ(coloured->valid.at(8, 8, c), 0);
    EXPECT_EQ(coloured->valid.at(5, 5, c), 1);
  }
  EXPECT_EQ(demosaic(*coloured, {}).error().code, ErrorCode::size_mismatch);
}

// A uniform scene of (3, 2, 1), and a pixel that is nearly dark: it neither lends its noise to others nor
// gets a colour, and keeps its own sample.
TEST(Mosaic, FactorsGiveEachPixelTheColoursAroundIt) {
  const BayerPattern filters{};  // RGGB
  const float light[3]{3, 2, 1};
  Image<float> flood({8, 8}, 3);
  for (int row = 0; row < 8; ++row)
    for (int col = 0; col < 8; ++col) flood.at(row, col, filters.at(row, col)) = light[filters.at(row, col)];
  flood.at(4, 4, 0) = 1e-6F;
  const auto factors = colour_factors(flood, filters);
  ASSERT_TRUE(factors.ok());
  Image<float> half = flood;
  for (float& v : half.values()) v /= 2;
  half.at(4, 4, 0) = 0.25F;
  const Image<float> picture = coloured(half, *factors);
  for (int row = 0; row < 8; ++row)
    for (int col = 0; col < 8; ++col)
      for (int c = 0; c < 3; ++c) {
        const bool dark = row == 4 && col == 4;
        const float wanted = !dark ? light[c] / 2 : c == 0 ? 0.25F : 0;
        EXPECT_NEAR(picture.at(row, col, c), wanted, 1e-6F) << row << " " << col << " " << c;
      }
}

}  // namespace
}  // namespace symrig::mosaic_test
