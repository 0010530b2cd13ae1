// SPDX-License-Identifier: Apache-2.0
// Noise that is not as a probe promises, over many rigs and kinds of noise.
#include "spoiled_capture.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <string>

#include <gtest/gtest.h>

namespace symrig::noise_check_accuracy_test {
namespace {

using tests::check_of;
using tests::default_options;
using tests::Gaussian;
using tests::kSpoiledGrid;
using tests::kSpoiledSigma;
using tests::tells;

Image<float> noise(double sigma, unsigned seed) {
  Gaussian gaussian(seed);
  Image<float> image(kSpoiledGrid);
  for (float& v : image.values()) v = static_cast<float>(sigma * gaussian());
  return image;
}

void add(Radiance& to, const Image<float>& image) {
  for (std::size_t i = 0; i < image.values().size(); ++i) to.mean.values()[i] += image.values()[i];
}

TEST(NoiseCheck, honest_noise_is_not_complained_about) {
  for (const char* scene : {"plane", "vgroove-white", "vgroove-mixed", "vgroove-textured", "gummy",
                            "occluder", "mirror", "views2", "views3"})
    for (const char* keys : {"?size=32x40&seed=921", "?size=20x20&seed=922&channels=3",
                             "?size=24x32&seed=923&exposures=1", "?size=24x32&seed=924&noise=off"}) {
      const std::string uri = std::string("sim:") + scene + keys;
      const auto rig = open_virtual_rig(uri);
      ASSERT_TRUE(rig.ok());
      const auto result = capture(**rig, default_options());
      ASSERT_TRUE(result.ok());
      EXPECT_TRUE(result->noise_check.findings.empty()) << uri << ": " << result->noise_check.findings[0];
    }
  const NoiseCheck honest = check_of([](Radiance&, int) {});
  EXPECT_TRUE(honest.findings.empty()) << honest.findings[0];
  // Five photographs at least of 768 samples each, differences of neighbours correlated by a half: the ratio
  // of squares is known to √(2 · 1.5 / 3072) = 3 %.
  EXPECT_NEAR(honest.variance_ratio, 1, 5 * 0.032);
}

TEST(NoiseCheck, a_variance_that_is_wrong_by_three_is_told) {
  const auto state = [](double factor) {
    return check_of([=](Radiance& answer, int) {
      for (float& v : answer.variance.values()) v *= static_cast<float>(factor);
    });
  };
  const NoiseCheck small = state(1 / 3.0);
  EXPECT_TRUE(tells(small, "variance"));
  EXPECT_NEAR(small.variance_ratio, 3, 0.5);
  const NoiseCheck large = state(3);
  EXPECT_TRUE(tells(large, "variance"));
  EXPECT_NEAR(large.variance_ratio, 1 / 3.0, 0.06);
}

TEST(NoiseCheck, noise_that_all_photographs_share_is_told) {
  const Image<float> common = noise(2 * kSpoiledSigma, 31);
  EXPECT_TRUE(tells(check_of([&](Radiance& answer, int) { add(answer, common); }), "add up"));
  // The same and nothing else: photographs of the same light are equal, against what they state.
  const Image<float> only = noise(kSpoiledSigma, 32);
  const NoiseCheck equal = check_of(
      [&](Radiance& answer, int) {
        add(answer, only);
        for (float& v : answer.variance.values()) v = static_cast<float>(kSpoiledSigma * kSpoiledSigma);
      },
      0);
  EXPECT_TRUE(tells(equal, "share"));
}

TEST(NoiseCheck, noise_of_rows_and_blurred_noise_are_told) {
  const NoiseCheck rows = check_of([](Radiance& answer, int photograph) {
    Gaussian gaussian(static_cast<std::uint64_t>(photograph) + 100);
    for (int r = 0; r < kSpoiledGrid.rows; ++r) {
      const auto one = static_cast<float>(kSpoiledSigma * gaussian());
      for (int c = 0; c < kSpoiledGrid.cols; ++c) answer.mean.at(r, c) += one;
    }
    for (float& v : answer.variance.values()) v *= 2;  // stated as it is, pixel by pixel
  });
  EXPECT_TRUE(tells(rows, "neighbouring"));
  const NoiseCheck blurred = check_of(
      [](Radiance& answer, int photograph) {
        const Image<float> white = noise(kSpoiledSigma, static_cast<unsigned>(photograph) + 500);
        for (int r = 0; r < kSpoiledGrid.rows; ++r)
          for (int c = 0; c + 1 < kSpoiledGrid.cols; ++c)
            answer.mean.at(r, c) += white.at(r, c) + white.at(r, c + 1);
        for (float& v : answer.variance.values()) v = static_cast<float>(2 * kSpoiledSigma * kSpoiledSigma);
      },
      0);
  EXPECT_TRUE(tells(blurred, "neighbouring"));
}

}  // namespace
}  // namespace symrig::noise_check_accuracy_test
