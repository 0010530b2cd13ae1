// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

/// Stands for the library of somebody else's rig: its own types, units and return codes, nothing of symrig.
/// A scene is inside, so that the example runs without devices.
namespace foreign {

inline constexpr int kWidth = 18, kHeight = 14;  // of the projector and of the camera
inline constexpr std::uint16_t kPedestal = 64, kWhiteLevel = 65'535, kSaturated = 4'095;
inline constexpr double kElectronsPerCount = 5, kReadNoise = 6;  // from the data sheet

/// 0: done; otherwise a number of the library.
class Rig {
 public:
  int connect() { return 0; }  // NOLINT(readability-convert-member-functions-to-static): as libraries have it

  /// levels: kWidth x kHeight, bottom row first. counts: the same order, from 0 to kSaturated.
  int shoot(const std::vector<std::uint16_t>& levels, std::vector<std::uint16_t>& counts) {
    if (levels.size() != std::size_t{kWidth} * kHeight) return 17;
    double haze = 0;  // light that everything gets from everything
    for (std::size_t i = 0; i < levels.size(); ++i) haze += glow(i) * levels[i] / kWhiteLevel;
    counts.resize(levels.size());
    for (std::size_t i = 0; i < levels.size(); ++i)
      counts[i] = expose(2'000 * albedo(i) * levels[i] / kWhiteLevel + 12 * glow(i) * haze);
    counts[100] = kSaturated;  // a hot pixel
    return 0;
  }

 private:
  static double albedo(std::size_t i) { return 0.6 + 0.4 * std::sin(0.7 * static_cast<double>(i)); }
  static double glow(std::size_t i) { return 0.3 + 0.2 * std::cos(0.1 * static_cast<double>(i)); }
  std::uint16_t expose(double light) {
    const double electrons = light * kElectronsPerCount;
    std::normal_distribution<double> noise(0, std::sqrt(electrons + kReadNoise * kReadNoise));
    const double count = kPedestal + (electrons + noise(random_)) / kElectronsPerCount;
    return static_cast<std::uint16_t>(std::clamp(std::round(count), 0.0, double{kSaturated}));
  }

  std::mt19937 random_{1};
};

}  // namespace foreign
