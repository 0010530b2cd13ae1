// SPDX-License-Identifier: Apache-2.0
// A camera that clips below the largest code, and what is burnt in all exposures.
// Exposures that contradict their photographs are refused before a curve is fitted; right ones are merged.
#include "calibration/sensor/bracket_checks.hpp"
#include "symrig/calibration/sensor_folder.hpp"
#include "synthetic_photographs.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
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

namespace symrig::bracket_order_test {
namespace {

/// Photographs of all shades, 5 to 40 ms. curve: of the camera, from light (1 = full) to codes (1 = full).
SensorPhotographs bracket(const std::vector<double>& light, const std::function<double(double)>& curve) {
  constexpr Grid kGrid{64, 64};
  SensorPhotographs all;
  all.grid = kGrid;
  all.bits = 8;
  std::uint64_t counter = 9ULL << 32;
  for (std::size_t k = 0; k < light.size(); ++k) {
    SensorPhotographs::Still still{{}, std::chrono::milliseconds(5 << k), fmt::format("{}.png", k)};
    for (int i = 0; i < kGrid.size(); ++i) {
      const double seen = light[k] * (1 + i % 997) / 997 + 0.003 * test::normal(counter);
      const double code = 255 * curve(std::clamp(seen, 0.0, 1.0));
      still.codes.push_back(static_cast<std::uint16_t>(std::lround(code)));
    }
    all.bracket.push_back(std::move(still));
  }
  return all;
}

double gamma(double light) {
  return std::pow(light, 1 / 2.2);
}

std::string refusal(const SensorPhotographs& photographs, const KnownCamera& known = {}) {
  const auto merged = merge_bracket(photographs, known);
  return merged.ok() ? std::string() : merged.error().line();
}

const std::vector<double> kRight{0.15, 0.3, 0.6, 1.2};

TEST(BracketOrder, right_exposures_are_merged) {
  EXPECT_EQ(refusal(bracket(kRight, gamma)), "");
  // Dark and burnt ones tell nothing, and a lamp that flickers by a tenth does not reverse them.
  for (const auto& light : {std::vector{0.15, 0.27, 0.66, 1.2}, std::vector{1.2, 2.4, 4.8, 9.6},
                            std::vector{0.002, 0.004, 0.008, 0.016}})
    EXPECT_TRUE(calibration::check_bracket_order(bracket(light, gamma)).ok());
}

TEST(BracketOrder, a_reversed_list_is_named) {
  std::vector<double> reversed(kRight.rbegin(), kRight.rend());
  for (const auto& curve : {std::function<double(double)>(gamma), {[](double v) { return v; }}}) {
    const std::string line = refusal(bracket(reversed, curve));
    EXPECT_NE(line.find("1.png (10 ms) is darker than 0.png (5 ms)"), std::string::npos) << line;
    EXPECT_NE(line.find("the exposures are in the reverse order"), std::string::npos) << line;
  }
  // A camera that is known to be linear has no curve to fit, and is not merged either.
  KnownCamera linear;
  linear.sensor.emplace();
  linear.sensor->noise = NoiseModel::from_electrons({.bits = 8, .pedestal = 0});
  const std::string line = refusal(bracket(reversed, [](double v) { return v; }), linear);
  EXPECT_NE(line.find("the exposures are in the reverse order"), std::string::npos) << line;
}

TEST(BracketOrder, two_exchanged_exposures_are_named) {
  const std::string line = refusal(bracket({0.15, 0.6, 0.3, 1.2}, gamma));
  EXPECT_NE(line.find("2.png (20 ms) is darker than 1.png (10 ms)"), std::string::npos) << line;
  EXPECT_NE(line.find("exposures are exchanged, or the light has changed"), std::string::npos) << line;
}

TEST(BracketOrder, a_camera_that_exposes_by_itself_is_named) {
  const std::string line = refusal(bracket({0.6, 0.6, 0.6, 0.6}, gamma));
  EXPECT_NE(line.find("1.png (10 ms) is as bright as 0.png (5 ms)"), std::string::npos) << line;
  EXPECT_NE(line.find("automatic exposure"), std::string::npos) << line;
}

}  // namespace
}  // namespace symrig::bracket_order_test
