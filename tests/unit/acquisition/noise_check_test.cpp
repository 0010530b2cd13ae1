// SPDX-License-Identifier: Apache-2.0
// Noise that is not as a probe promises: told when gross, and never where it is as promised.
#include "symrig/acquisition/noise_check.hpp"

#include "dense_scene.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "workbench.hpp"

#include <cmath>
#include <functional>
#include <string>

#include <gtest/gtest.h>

namespace symrig {
namespace {

using tests::default_options;
using tests::DenseProbe;
using tests::DenseTransport;
using tests::facing_planes;
using tests::Gaussian;

constexpr Grid kGrid{24, 32};
constexpr double kSigma = 2e-3;

NoiseCheck check_of(const std::function<void(Radiance&, int photograph)>& spoil, double sigma = kSigma) {
  const DenseTransport scene = facing_planes(kGrid);
  DenseProbe probe(scene, sigma);
  int taken = 0;
  probe.spoil = [&](Radiance& answer) { spoil(answer, taken++); };
  const auto result = capture(probe, default_options());
  EXPECT_TRUE(result.ok());
  return result->noise_check;
}

bool tells(const NoiseCheck& check, const std::string& word) {
  for (const std::string& finding : check.findings)
    if (finding.find(word) != std::string::npos) return true;
  return false;
}

Image<float> noise(double sigma, unsigned seed) {
  Gaussian gaussian(seed);
  Image<float> image(kGrid);
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
      const auto rig = sim::open_virtual_rig(uri);
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
  const Image<float> common = noise(2 * kSigma, 31);
  EXPECT_TRUE(tells(check_of([&](Radiance& answer, int) { add(answer, common); }), "add up"));
  // The same and nothing else: photographs of the same light are equal, against what they state.
  const Image<float> only = noise(kSigma, 32);
  const NoiseCheck equal = check_of(
      [&](Radiance& answer, int) {
        add(answer, only);
        for (float& v : answer.variance.values()) v = static_cast<float>(kSigma * kSigma);
      },
      0);
  EXPECT_TRUE(tells(equal, "share"));
}

TEST(NoiseCheck, noise_of_rows_and_blurred_noise_are_told) {
  const NoiseCheck rows = check_of([](Radiance& answer, int photograph) {
    Gaussian gaussian(static_cast<std::uint64_t>(photograph) + 100);
    for (int r = 0; r < kGrid.rows; ++r) {
      const auto one = static_cast<float>(kSigma * gaussian());
      for (int c = 0; c < kGrid.cols; ++c) answer.mean.at(r, c) += one;
    }
    for (float& v : answer.variance.values()) v *= 2;  // stated as it is, pixel by pixel
  });
  EXPECT_TRUE(tells(rows, "neighbouring"));
  const NoiseCheck blurred = check_of(
      [](Radiance& answer, int photograph) {
        const Image<float> white = noise(kSigma, static_cast<unsigned>(photograph) + 500);
        for (int r = 0; r < kGrid.rows; ++r)
          for (int c = 0; c + 1 < kGrid.cols; ++c)
            answer.mean.at(r, c) += white.at(r, c) + white.at(r, c + 1);
        for (float& v : answer.variance.values()) v = static_cast<float>(2 * kSigma * kSigma);
      },
      0);
  EXPECT_TRUE(tells(blurred, "neighbouring"));
}

TEST(NoiseCheck, a_lamp_that_flickers_slowly_is_told) {
  const NoiseCheck check = check_of([](Radiance& answer, int photograph) {
    const auto level = static_cast<float>(1 + 0.03 * std::sin(0.05 * photograph));
    for (float& v : answer.mean.values()) v *= level;
  });
  EXPECT_TRUE(tells(check, "light changed"));
}

TEST(NoiseCheck, photographs_without_a_variance_must_have_no_noise) {
  const NoiseCheck check = check_of(
      [](Radiance& answer, int) {
        for (float& v : answer.variance.values()) v = 0;
      },
      0.01);
  EXPECT_TRUE(tells(check, "state no noise"));
}

}  // namespace
}  // namespace symrig
