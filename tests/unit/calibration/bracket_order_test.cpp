// SPDX-License-Identifier: Apache-2.0
// Exposures that contradict their photographs are refused before a curve is fitted; right ones are merged.
#include "calibration/bracket_order.hpp"

#include "symrig/calibration/bracket_merge.hpp"
#include "synthetic_photographs.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

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
