// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/first_bounce.hpp"

#include "synthetic_photographs.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace symrig::first_bounce_test {
namespace {

using test::SyntheticScene;

/// rms difference over all pixels.
double rms(const Image<float>& a, const Image<float>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.values().size(); ++i)
    sum += std::pow(static_cast<double>(a.values()[i] - b.values()[i]), 2);
  return std::sqrt(sum / static_cast<double>(a.values().size()));
}

class FirstBounceWithoutAPair : public testing::TestWithParam<int> {};

TEST_P(FirstBounceWithoutAPair, PredictsIt) {
  const auto fit = fit_first_bounce(test::default_photographs(), {.decode = {.held_out_pair = GetParam()}});
  ASSERT_TRUE(fit.ok()) << fit.error().line();
  ASSERT_EQ(fit->errors.size(), 2U);
  // Noise is 0.004 / 0.4 of mean white = 1 %. On an edge a position error of 0.1 px makes 0.1 / (√(2π) 0.6) =
  // 7 % over about two projector pixels a stripe; with stripes of 8 px that is 7 % √(2 / 8) = 3.5 %. Together
  // below 4 %.
  for (const PredictionError& error : fit->errors) {
    EXPECT_LE(error.rms_lit, 0.04) << error.name;
    EXPECT_GT(error.rms_lit, 0.005) << error.name;  // below the noise: the fit has seen it
  }
  EXPECT_NE(fit->held_out[0].pattern, fit->held_out[1].pattern);
}

TEST_P(FirstBounceWithoutAPair, NeverLooksAtIt) {
  auto photographs = test::default_photographs();
  const FitOptions options{.decode = {.held_out_pair = GetParam()}};
  const auto before = fit_first_bounce(photographs, options);
  for (int complement = 0; complement < 2; ++complement)
    for (float& v : photographs.images[2 * GetParam() + complement].values()) v = 0.25F;
  const auto after = fit_first_bounce(photographs, options);
  ASSERT_TRUE(before.ok() && after.ok());
  EXPECT_TRUE(std::ranges::equal(before->tensor.column_values(), after->tensor.column_values()));
  EXPECT_TRUE(std::ranges::equal(*before->tensor.factors(), *after->tensor.factors()));
  EXPECT_EQ(before->black, after->black);
}
INSTANTIATE_TEST_SUITE_P(Pairs, FirstBounceWithoutAPair, testing::Values(0, 1, 3, 7, 8, 10));

TEST(FirstBounce, FindsBlurAndShares) {
  const auto fit = fit_first_bounce(test::default_photographs());
  ASSERT_TRUE(fit.ok()) << fit.error().line();
  // The scene's footprint has blur 0.6; the fit's is integrated over a projector pixel as the scene's is.
  EXPECT_NEAR(fit->statistics.footprint_sigma, 0.6, 0.15);
  // 90 % direct light outside the shadow; lit pixels include the shadow, where far light is well above the
  // noise.
  EXPECT_NEAR(fit->statistics.direct_share, 0.9, 0.03);
  EXPECT_TRUE(fit->held_out.empty());
}

TEST(FirstBounce, PredictsAPatternUnlikeStripes) {
  // A bright disc and a grey ramp: neither is in the sequence.
  const SyntheticScene scene;
  const auto fit = fit_first_bounce(test::default_photographs());
  ASSERT_TRUE(fit.ok());
  Pattern pattern(scene.projector);
  for (int r = 0; r < 80; ++r)
    for (int c = 0; c < 100; ++c)
      pattern.at(r, c) = std::hypot(r - 30, c - 60) < 17 ? 1.0F : static_cast<float>(c) / 200;
  const auto predicted = fit->tensor.apply(pattern);
  ASSERT_TRUE(predicted.ok());
  Image<float> truth = test::photograph(scene, pattern);
  for (float& v : truth.values()) v -= static_cast<float>(scene.black);
  EXPECT_LE(rms(*predicted, truth) / fit->statistics.mean_white, 0.04);
}

TEST(FirstBounce, BlackIsThatOfTheScene) {
  const SyntheticScene scene;
  const auto fit = fit_first_bounce(test::default_photographs());
  ASSERT_TRUE(fit.ok());
  // 30 photographs of noise 0.0042 and four unknowns; the standard error of the intercept is below 0.0042 · 2
  // / √30 · 2.
  EXPECT_LE(rms(fit->black, Image<float>(scene.camera, 1, 0.03F)), 0.004);
}

TEST(FirstBounce, TensorHoldsCameraAndProjectorGrids) {
  const SyntheticScene scene;
  const auto fit = fit_first_bounce(test::default_photographs());
  ASSERT_TRUE(fit.ok());
  EXPECT_FALSE(fit->tensor.symmetric());
  EXPECT_EQ(fit->tensor.camera_grid(), scene.camera);
  EXPECT_EQ(fit->tensor.projector_grid(), scene.projector);
}

TEST(FirstBounce, RefusesOptionsOutOfRange) {
  const auto& photographs = test::default_photographs();
  EXPECT_EQ(fit_first_bounce(photographs, {.surroundings = -1}).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(fit_first_bounce(photographs, {.weight_cutoff = 1}).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(fit_first_bounce("no/such/folder").error().code, ErrorCode::not_found);
}

}  // namespace
}  // namespace symrig::first_bounce_test
