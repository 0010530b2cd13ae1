// SPDX-License-Identifier: Apache-2.0
// How often the truth lies within the interval that a capture states: seeds and sizes that nothing was tuned
// on.
#include "judged_capture.hpp"
#include "symrig/acquisition/error_estimate.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <array>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

namespace symrig::error_interval_test {
namespace {

using tests::judge;
using tests::Judged;

constexpr std::array<double TransportErrors::*, 7> kErrors{
    &TransportErrors::frobenius,   &TransportErrors::indirect,       &TransportErrors::flood,
    &TransportErrors::relight_bar, &TransportErrors::relight_random, &TransportErrors::relight_natural,
    &TransportErrors::bar_indirect};

/// Counts how often the truth lies within the stated interval.
struct Coverage {
  int inside = 0, all = 0, narrow = 0;
  std::string missed;

  void add(const std::string& uri, const Judged& judged) {
    for (std::size_t k = 0; k < kErrors.size(); ++k) {
      const double value = (*judged.result.estimated).*kErrors[k];
      const double width = judged.result.estimated_half_width.*kErrors[k];
      if (std::isnan(value)) continue;
      const double truth = judged.truth.*kErrors[k];
      const bool in = std::abs(truth - value) <= width + 1e-6;
      ++all;
      inside += in ? 1 : 0;
      narrow += width < value ? 1 : 0;
      if (!in)
        missed += uri + " " + std::to_string(k) + ": " + std::to_string(truth) + " not in " +
                  std::to_string(value) + " +- " + std::to_string(width) + "\n";
    }
  }
  /// At the stated confidence, less three standard deviations of a binomial count.
  double least() const { return all * kErrorConfidence - 3 * std::sqrt(all * 0.95 * 0.05); }
};

constexpr const char* kScenes[] = {"plane", "vgroove-white", "vgroove-mixed", "vgroove-textured",
                                   "gummy", "occluder",      "mirror",        "views2",
                                   "views3"};

TEST(ErrorEstimate, the_truth_lies_within_the_stated_interval) {
  int narrow = 0, all = 0;
  for (const char* keys :
       {"?size=36x44&seed=907", "?size=36x44&seed=908&noise=off", "?size=29x31&seed=909&psf=0.08"}) {
    Coverage coverage;
    for (const char* scene : kScenes) {
      const std::string uri = std::string("sim:") + scene + keys;
      coverage.add(uri, judge(uri));
    }
    EXPECT_GE(coverage.inside, coverage.least()) << coverage.missed;
    narrow += coverage.narrow;
    all += coverage.all;
  }
  // With noise about as large as the errors on so few pixels, intervals of some errors reach down to 0: of
  // the third group, where light spreads, two of three do.
  EXPECT_GT(narrow, all / 3) << "intervals say something";
}

TEST(ErrorEstimate, of_a_search_that_a_budget_ended_too) {
  for (const std::int64_t most : {8, 24, 60}) {
    Coverage coverage;
    for (const char* scene : kScenes) {
      const std::string uri = std::string("sim:") + scene + "?size=33x40&seed=911";
      coverage.add(uri, judge(uri, most));
    }
    EXPECT_GE(coverage.inside, coverage.least()) << most << "\n" << coverage.missed;
  }
}

TEST(ErrorEstimate, of_indirect_light_is_within_its_interval_or_not_given_on_misaligned_rigs) {
  int given = 0, inside = 0;
  for (const char* scene : {"plane", "vgroove-textured", "gummy", "occluder"})
    for (const char* shift : {"0.1", "0.4", "1"}) {
      const std::string uri = std::string("sim:") + scene + "?size=28x32&seed=913&misalign=" + shift;
      const Judged judged = judge(uri, 0, true);
      const double value = judged.result.estimated->indirect;
      if (std::isnan(value)) {
        EXPECT_NE(judged.result.estimate_not_given[0].reason.find("one side"), std::string::npos) << uri;
        continue;
      }
      ++given;
      inside +=
          std::abs(value - judged.truth.indirect) <= judged.result.estimated_half_width.indirect ? 1 : 0;
    }
  EXPECT_LE(given - inside, 1) << "of " << given;
}

}  // namespace

}  // namespace symrig::error_interval_test

namespace symrig::noise_check_accuracy_test {

// Noise that is not as a probe promises, over many rigs and kinds of noise.

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
