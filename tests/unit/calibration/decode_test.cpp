// SPDX-License-Identifier: Apache-2.0
#include "scratch.hpp"
#include "symrig/calibration/pixel_map.hpp"
#include "symrig/image/file.hpp"
#include "synthetic_photographs.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>

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

namespace symrig::map_accuracy_test {
namespace {

constexpr double kBlur = 0.5;    // PSF of projector, camera and camera pixel together [projector pixels]
constexpr double kBlack = 0.05;  // black level, share of white
constexpr double kFullWell = 20'000, kRead = 6,
                 kLargest = 4095;  // the simulated camera, docs/command-line.md

/// Light of a row of stripes under a Gaussian at x, by sampling it at 200 points within five sigmas.
double under(const std::vector<float>& stripes, double x) {
  double sum = 0, weights = 0;
  for (int i = -100; i <= 100; ++i) {
    const double d = 0.05 * i * kBlur, w = std::exp(-0.5 * d * d / (kBlur * kBlur));
    const auto at = std::lround(x + d);
    weights += w;
    if (at >= 0 && at < std::ssize(stripes)) sum += w * static_cast<double>(stripes[at]);
  }
  return sum / weights;
}

std::vector<float> stripes_of(const GrayCode& code, int photograph) {
  const bool columns = photograph >= code.white() || code.pair(photograph / 2).axis == StripeAxis::columns;
  const Pattern pattern = code.pattern(photograph);
  std::vector<float> stripes;
  for (int i = 0; i < (columns ? code.projector().cols : code.projector().rows); ++i)
    stripes.push_back(columns ? pattern.at(0, i) : pattern.at(i, 0));
  return stripes;
}

/// Shot and read noise, 12 bits; white is 0.9 of the full well at albedo 1.
float camera_code(double light, std::uint64_t& counter) {
  const double electrons = 0.9 * kFullWell * light;
  const double noisy = electrons + std::sqrt(electrons + kRead * kRead) * test::normal(counter);
  return static_cast<float>(std::round(std::clamp(noisy / kFullWell, 0.0, 1.0) * kLargest) / kLargest);
}

CodePhotographs photographs_of(const test::SyntheticScene& scene) {
  const GrayCode code(scene.projector);
  CodePhotographs photographs{code, {}, {}};
  std::uint64_t counter = 1;
  for (int k = 0; k < code.photographs(); ++k) {
    const auto stripes = stripes_of(code, k);
    const bool columns = k >= code.white() || code.pair(k / 2).axis == StripeAxis::columns;
    Image<float> image(scene.camera);
    for (int r = 0; r < scene.camera.rows; ++r)
      for (int c = 0; c < scene.camera.cols; ++c) {
        const double light = under(stripes, columns ? scene.col(r, c) : test::SyntheticScene::row(r, c));
        image.at(r, c) =
            camera_code(test::SyntheticScene::albedo(r, c) * (kBlack + (1 - kBlack) * light), counter);
      }
    photographs.images.push_back(std::move(image));
    photographs.names.push_back(std::to_string(k));
  }
  return photographs;
}

// Where a stripe's edge lies under the footprint a difference changes by 2 / (√(2π) 0.5) = 1.6 of direct
// light a pixel, and every whole position is the edge of one bit; noise is below 2 % of it: 0.02 px. The rest
// is how well a mixture of fixed widths describes this footprint. Bar: 0.1 px, 99.5 %.
TEST(MapAccuracy, IsATenthOfAPixelUnderPsfBlackLevelAndNoise) {
  const test::SyntheticScene scene;
  const auto map = decode(photographs_of(scene));
  ASSERT_TRUE(map.ok()) << map.error().line();
  double squares = 0, decoded = 0, lit = 0, within = 0;
  for (int r = 0; r < scene.camera.rows; ++r)
    for (int c = 0; c < scene.camera.cols; ++c) {
      const double x = scene.col(r, c), y = test::SyntheticScene::row(r, c);
      if (x < 1 || x > scene.projector.cols - 2 || y < 1 || y > scene.projector.rows - 2) continue;
      lit += 1;
      if (!map->mask.at(r, c)) continue;
      const double dx = static_cast<double>(map->col.at(r, c)) - x,
                   dy = static_cast<double>(map->row.at(r, c)) - y;
      decoded += 1;
      squares += (dx * dx + dy * dy) / 2;
      within += std::abs(dx) < 4 * static_cast<double>(map->col_sigma.at(r, c)) ? 1 : 0;
    }
  const double rms = std::sqrt(squares / decoded);
  RecordProperty("rms_pixels", std::to_string(rms));
  RecordProperty("decoded", std::to_string(decoded / lit));
  EXPECT_LE(rms, 0.1);
  EXPECT_GT(rms, 0.005);  // noise alone
  EXPECT_GE(decoded / lit, 0.995);
  EXPECT_GE(within / decoded, 0.99);  // the stated sigmas hold
}

// The judge: an affine map with known errors.
TEST(MapQuality, FindsOutliersAndResiduals) {
  const Grid camera{60, 80};
  PixelMap map{camera,
               {64, 64},
               Image<float>(camera),
               Image<float>(camera),
               Image<std::uint8_t>(camera, 1, 1),
               {},
               {},
               Image<float>(camera, 1, 0.5F),
               0};
  std::uint64_t counter = 7;
  constexpr double kNoise = 0.2;
  int wrong = 0;
  for (int r = 0; r < camera.rows; ++r)
    for (int c = 0; c < camera.cols; ++c) {
      const bool far = (r * 31 + c * 17) % 50 == 0;
      wrong += far ? 1 : 0;
      // Two planes that meet at column 40 with a step of 5 pixels.
      map.col.at(r, c) = static_cast<float>(0.6 * c + 0.02 * r + (c < 40 ? 0 : 5) + (far ? 3 : 0) +
                                            kNoise * test::normal(counter));
      map.row.at(r, c) = static_cast<float>(0.6 * r + kNoise * test::normal(counter));
    }
  const MapQuality quality = judge_map(map);
  EXPECT_EQ(quality.lit_share, 1);
  EXPECT_EQ(quality.valid_share, 1);
  // 12-bit codes in 16-bit files: a sixteenth of the range says the same.
  PixelMap dim = map;
  for (float& v : dim.contrast.values()) v /= 16;
  EXPECT_EQ(judge_map(dim).lit_share, 1);
  EXPECT_EQ(judge_map(dim).rms, quality.rms);
  // At the step, whose window holds both planes by halves, up to two columns on either side may be taken for
  // outliers; never is an outlier missed.
  const double share = static_cast<double>(wrong) / static_cast<double>(camera.size());
  EXPECT_GE(quality.outlier_share, share);
  EXPECT_LE(quality.outlier_share, share + 4.0 / camera.cols + 0.005);
  // Leaving the pixel out adds the fit's own variance, 3 of 224 neighbours: below 2 %.
  EXPECT_NEAR(quality.rms, kNoise, 0.05 * kNoise);
}

}  // namespace
}  // namespace symrig::map_accuracy_test

namespace symrig::map_file_test {
namespace {

Image<float> good() {
  Image<float> picture(Grid{3, 4}, 3);
  picture.at(1, 2, 0) = 63;
  picture.at(1, 2, 1) = 0.25F;
  picture.at(1, 2, 2) = 1;
  return picture;
}

TEST(MapFile, ComesBackAsItWasWritten) {
  const auto map = decode(test::default_photographs());
  ASSERT_TRUE(map.ok()) << map.error().line();
  const test::Scratch scratch;
  const auto path = scratch / "map.exr";
  ASSERT_TRUE(write_image(path, map_picture(*map)).ok());
  const auto read = read_pixel_map(path, map->projector);
  ASSERT_TRUE(read.ok()) << read.error().line();
  EXPECT_EQ(read->camera, map->camera);
  EXPECT_EQ(read->mask, map->mask);
  for (std::size_t i = 0; i < map->mask.values().size(); ++i) {
    EXPECT_EQ(read->col.values()[i], map->mask.values()[i] ? map->col.values()[i] : 0);
    EXPECT_EQ(read->row.values()[i], map->mask.values()[i] ? map->row.values()[i] : 0);
  }
}

TEST(MapFile, OfAnotherProjectorNamesThePixel) {
  EXPECT_TRUE(map_of_picture(good(), {64, 64}, "map.exr").ok());
  const auto refused = map_of_picture(good(), {64, 63}, "map.exr");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::bad_value);
  EXPECT_NE(refused.error().line().find("map.exr: pixel (1, 2) looks at row 0.25, column 63"),
            std::string::npos)
      << refused.error().line();
}

TEST(MapFile, AnyOtherPictureIsRefused) {
  EXPECT_EQ(map_of_picture(Image<float>(Grid{3, 4}), {64, 64}, "x").error().code, ErrorCode::bad_format);
  Image<float> colours = good();
  colours.at(0, 0, 2) = 0.5F;
  EXPECT_EQ(map_of_picture(colours, {64, 64}, "x").error().code, ErrorCode::bad_format);
}

}  // namespace
}  // namespace symrig::map_file_test
