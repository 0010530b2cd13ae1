// SPDX-License-Identifier: Apache-2.0
// A camera that clips below the largest code, and what is burnt in all exposures.
#include "symrig/calibration/bracket_merge.hpp"
#include "synthetic_photographs.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace symrig::bracket_clipping_test {
namespace {

constexpr Grid kGrid{80, 100};
constexpr double kBrightest = 2.4e6;  ///< [e⁻/s] of the brightest pixel

double light(int i) {
  return kBrightest * (1 + i % 997) / 997;
}

/// 5, 10, 20 and 40 ms with a linear camera of 12 bits. gain: factor on the light.
SensorPhotographs bracket(double clip, double gain) {
  const NoiseModel noise = NoiseModel::from_electrons({});
  SensorPhotographs all;
  all.grid = kGrid;
  all.bits = 12;
  std::uint64_t counter = 21ULL << 32;
  for (int k = 0; k < 4; ++k) {
    SensorPhotographs::Still still{{}, std::chrono::milliseconds(5 << k), fmt::format("{}.png", k)};
    for (int i = 0; i < kGrid.size(); ++i) {
      const double electrons = gain * light(i) * 5e-3 * (1 << k);
      const double seen = electrons + std::sqrt(noise.variance(electrons)) * test::normal(counter);
      const double code = std::min(noise.pedestal() + noise.gain() * seen, clip);
      still.codes.push_back(static_cast<std::uint16_t>(std::lround(std::clamp(code, 0.0, 4095.0))));
    }
    all.bracket.push_back(std::move(still));
  }
  return all;
}

KnownCamera known_camera() {
  KnownCamera known;
  known.sensor.emplace();
  known.sensor->noise = NoiseModel::from_electrons({});
  return known;
}

bool warns(const MergedBracket& merged, const std::string& of) {
  return std::ranges::any_of(merged.warnings,
                             [&](const std::string& one) { return one.find(of) != std::string::npos; });
}

/// The largest departure of the bright valid pixels' mean over groups of one light, relative to it.
double departure(const MergedBracket& merged, double gain) {
  double worst = 0;
  for (int shade = 500; shade < 997; ++shade) {
    double sum = 0, count = 0;
    for (int i = shade; i < kGrid.size(); i += 997)
      if (merged.radiance.valid.values()[i] != 0) sum += merged.radiance.mean.values()[i], count += 1;
    if (count > 0) worst = std::max(worst, std::abs(sum / count / light(shade) / gain - 1));
  }
  return worst;
}

// Full scale is 20,000 electrons: the longest exposure collects up to 96,000 of them, or 21,000.
TEST(BracketClipping, the_code_where_long_exposures_stay_is_used) {
  for (const double clip : {3800.0, 2500.0})
    for (const double gain : {1.0, 0.22}) {
      const auto merged = merge_bracket(bracket(clip, gain), known_camera());
      ASSERT_TRUE(merged.ok()) << merged.error().line();
      EXPECT_TRUE(warns(*merged, fmt::format("the camera clips at code {:.0f}, not at 4095", clip)))
          << clip << " " << gain;
      // Eight pixels of each shade; the dimmest of them have 10,000 electrons in the longest exposure that
      // counts, or 5,000 where half of it clips: 1.4 % / √8, at four sigmas.
      EXPECT_LT(departure(*merged, gain), 0.02) << clip << " " << gain;
    }
}

TEST(BracketClipping, a_camera_that_clips_as_it_says_gets_no_warning) {
  for (const double gain : {0.05, 0.2, 1.0}) {
    const auto merged = merge_bracket(bracket(4095, gain), known_camera());
    ASSERT_TRUE(merged.ok()) << merged.error().line();
    EXPECT_TRUE(merged->warnings.empty()) << gain << merged->warnings.front();
  }
}

TEST(BracketClipping, what_is_burnt_in_all_exposures_is_told) {
  const auto merged = merge_bracket(bracket(4095, 4), known_camera());
  ASSERT_TRUE(merged.ok()) << merged.error().line();
  EXPECT_TRUE(warns(*merged, "are saturated in all exposures"));
}

}  // namespace
}  // namespace symrig::bracket_clipping_test
