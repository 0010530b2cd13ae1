// SPDX-License-Identifier: Apache-2.0
// A camera that clips below the largest code, and what is burnt in all exposures.
// Exposures that contradict their photographs are refused before a curve is fitted; right ones are merged.
#include "calibration/sensor/bracket_checks.hpp"
#include "symrig/base/statistics.hpp"
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

namespace symrig::unknown_camera_test {
namespace {

constexpr Grid kGrid{120, 150};

/// A camera that is not known, and how its bracket was taken.
struct Unknown {
  int bits = 12;
  double pedestal = 0;    ///< share of the range
  double gamma = 1;       ///< code = light^(1/γ)
  double white = 1;       ///< share of the range at which light clips
  double scatter = 0;     ///< of a code, after the clipping, as a share of the range
  double ratio = 4;       ///< of stated exposures
  double true_ratio = 4;  ///< of those that it made

  double largest() const { return std::exp2(bits) - 1; }
};

/// Light of a pixel: 1 gives the largest code in one second. Four decades, and smooth: 0.0001 to 1.
double light(int i) {
  return std::pow(10, -4 + 4 * (i % 9973) / 9973.0);
}

SensorPhotographs bracket(const Unknown& camera, int exposures) {
  SensorPhotographs all;
  all.grid = kGrid;
  all.bits = camera.bits;
  const double full_well = std::max(10'000.0, 4 * std::exp2(camera.bits));  // [e⁻]
  const double pedestal = std::round(camera.pedestal * camera.largest());
  std::uint64_t counter = 77ULL << 32;
  for (int k = 0; k < exposures; ++k) {
    const double stated = 1.5 * std::pow(camera.ratio, k), made = 1.5 * std::pow(camera.true_ratio, k);
    SensorPhotographs::Still still{{}, Nanoseconds{std::llround(stated * 1e9)}, fmt::format("{}.png", k)};
    for (int i = 0; i < kGrid.size(); ++i) {
      const double ideal = light(i) * made;
      const double seen = std::max(0.0, ideal + std::sqrt(ideal / full_well) * test::normal(counter));
      const double range = camera.largest() - pedestal;
      double code = pedestal + range * std::pow(std::min(seen, 100.0), 1 / camera.gamma);
      code += 0.7 * test::normal(counter);
      code = std::min(code, camera.white * camera.largest());
      code += camera.scatter * camera.largest() * test::normal(counter);
      still.codes.push_back(static_cast<std::uint16_t>(std::lround(std::clamp(code, 0.0, camera.largest()))));
    }
    all.bracket.push_back(std::move(still));
  }
  return all;
}

/// Shares of the valid values.
struct Wrong {
  double by_a_tenth = 0;   ///< of those whose noise is below 3 %
  double beyond_five = 0;  ///< of the stated deviations
  double mean_square = 0;  ///< of departures in stated deviations
  double valid = 0;        ///< of all
};
/// unit: of the radiance.
Wrong wrong(const MergedBracket& merged, double unit = 1) {
  Wrong share;
  double known = 0;
  for (int i = 0; i < kGrid.size(); ++i) {
    if (merged.radiance.valid.values()[i] == 0) continue;
    const double mean = merged.radiance.mean.values()[i] / unit;
    const double sigma = std::sqrt(merged.radiance.variance.values()[i]) / unit;
    const double z = (mean - light(i)) / sigma;
    share.valid += 1;
    share.beyond_five += std::abs(z) > 5 ? 1 : 0;
    share.mean_square += z * z;
    if (sigma > 0.03 * mean) continue;
    known += 1;
    share.by_a_tenth += std::abs(mean / light(i) - 1) > 0.1 ? 1 : 0;
  }
  share.by_a_tenth /= known;
  share.beyond_five /= share.valid;
  share.mean_square /= share.valid;
  share.valid /= static_cast<double>(kGrid.size());
  return share;
}

/// By a curve: the codes next to white, which no sample tells, decide the unit.
double unit_of(const MergedBracket& merged) {
  std::vector<double> units;
  for (int i = 0; i < kGrid.size(); ++i)
    if (merged.radiance.valid.values()[i] != 0) units.push_back(merged.radiance.mean.values()[i] / light(i));
  return median(units);
}

// Noise is known to 10 %, and 18,000 squares of normal quantities have a mean within 5 √(2 / 18,000).
constexpr double kLeastSquare = 0.85, kMostSquare = 1.15;

TEST(UnknownCamera, a_linear_one_is_merged_by_its_straight_line) {
  for (const int bits : {8, 10, 12, 14, 16})
    for (const double pedestal : {0.0, 1.0 / 64})
      for (const double ratio : {2.0, 4.0}) {
        const auto merged =
            merge_bracket(bracket({.bits = bits, .pedestal = pedestal, .ratio = ratio, .true_ratio = ratio},
                                  ratio > 3 ? 5 : 8),
                          {});
        ASSERT_TRUE(merged.ok()) << merged.error().line();
        ASSERT_TRUE(merged->camera.straight) << bits << " " << pedestal << " " << ratio;
        const Wrong share = wrong(*merged);
        // A pedestal of 0 cuts the noise of the darkest pixels.
        EXPECT_LE(share.by_a_tenth, 0.001) << bits << " " << pedestal << " " << ratio;
        EXPECT_LE(share.beyond_five, 0.001) << bits << " " << pedestal << " " << ratio;
        EXPECT_GT(share.mean_square, kLeastSquare) << bits << " " << pedestal << " " << ratio;
        EXPECT_LT(share.mean_square, kMostSquare) << bits << " " << pedestal << " " << ratio;
        EXPECT_GT(share.valid, 0.9);
        EXPECT_STREQ(merged->units, "light of the largest code per second");
      }
}

// Codes at white scatter where noise comes after the clipping, or where photographs were compressed.
TEST(UnknownCamera, white_that_scatters_is_white) {
  for (const double gamma : {1.0, 2.2})
    for (const double white : {1.0, 0.95})
      for (const int bits : {8, 12}) {
        const auto merged =
            merge_bracket(bracket({.bits = bits, .gamma = gamma, .white = white, .scatter = 0.003}, 5), {});
        ASSERT_TRUE(merged.ok()) << merged.error().line();
        const Wrong share = wrong(*merged, gamma == 1 ? 1 : unit_of(*merged));
        EXPECT_LE(share.by_a_tenth, 0.001) << bits << " " << gamma << " " << white;
        EXPECT_LE(share.valid, 0.98);  // of 18,000 pixels, 439 to 700 are white in the shortest exposure
        EXPECT_LE(share.beyond_five, 0.001) << bits << " " << gamma << " " << white;
        EXPECT_GT(share.valid, 0.95);
      }
}

TEST(UnknownCamera, a_curve_of_many_codes_is_right_at_dark_ones) {
  for (const int bits : {12, 14}) {
    const auto merged = merge_bracket(bracket({.bits = bits, .gamma = 1.8}, 5), {});
    ASSERT_TRUE(merged.ok()) << merged.error().line();
    EXPECT_FALSE(merged->camera.straight);
    const Wrong share = wrong(*merged, unit_of(*merged));
    EXPECT_LE(share.by_a_tenth, 0.001) << bits;
    EXPECT_LE(share.beyond_five, 0.001) << bits;
  }
}

// The scene is elsewhere in each photograph, so a curve would take all of it for noise. (A ramp that moves a
// little is as if exposures were others.)
TEST(UnknownCamera, a_scene_that_moves_in_each_photograph_is_refused) {
  SensorPhotographs photographs = bracket({.bits = 8, .gamma = 2.2, .ratio = 2, .true_ratio = 2}, 5);
  for (std::size_t k = 0; k < photographs.bracket.size(); ++k) {
    auto& codes = photographs.bracket[k].codes;
    std::rotate(codes.begin(), codes.begin() + static_cast<std::ptrdiff_t>(3700 * k), codes.end());
  }
  const auto merged = merge_bracket(photographs, {});
  ASSERT_FALSE(merged.ok());
  EXPECT_EQ(merged.error().code, ErrorCode::bad_value);
}

TEST(UnknownCamera, dark_photographs_leave_the_unit_of_a_curve_open) {
  for (const bool dark : {false, true}) {
    SensorPhotographs photographs = bracket({.bits = 8, .gamma = 2.2, .ratio = 2, .true_ratio = 2}, 5);
    if (dark)
      for (auto& still : photographs.bracket)
        for (std::uint16_t& code : still.codes) code = static_cast<std::uint16_t>(code / 3);
    const auto merged = merge_bracket(photographs, {}, {.unchecked = true});
    ASSERT_TRUE(merged.ok()) << merged.error().line();
    EXPECT_EQ(std::ranges::any_of(
                  merged->warnings,
                  [](const std::string& one) { return one.starts_with("no photograph reaches half"); }),
              dark);
  }
}

// A weak curve looks like a line whose exposures are wrong, so both are no straight camera.
TEST(UnknownCamera, what_is_no_straight_line_is_not_taken_for_one) {
  for (const Unknown& camera :
       {Unknown{.gamma = 1.1}, Unknown{.true_ratio = 3.8}, Unknown{.bits = 8, .gamma = 1.1}}) {
    const auto merged = merge_bracket(bracket(camera, 5), {}, {.unchecked = true});
    ASSERT_TRUE(merged.ok()) << merged.error().line();
    EXPECT_FALSE(merged->camera.straight);
  }
}

}  // namespace
}  // namespace symrig::unknown_camera_test
