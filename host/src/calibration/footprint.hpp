// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>

namespace symrig::calibration {

/// Weights of a camera pixel's footprint along one axis of the projector: pixels [first, first + count), Σ
/// weight = 1.
struct Taps {
  static constexpr int kMax = 32;
  int first = 0, count = 0;
  std::array<float, kMax> weight{};

  /// Σ weight · values over the axis.
  float sum(std::span<const float> values) const {
    const auto under = values.subspan(first, count);
    float total = 0;
    for (std::size_t i = 0; i < under.size(); ++i) total += weight[i] * under[i];
    return total;
  }
};

/// The widest blur that Taps can hold at three sigmas.
inline constexpr double kLargestSigma = 4;

/// A Gaussian of `sigma` around `position`, integrated over each pixel j, which covers [j − ½, j + ½). It is
/// cut at three sigmas and at the border of the `size` pixels, then scaled to the sum 1.
inline Taps gaussian_taps(double position, double sigma, int size) {
  const double reach = 3 * sigma + 0.5;
  Taps taps;
  taps.first = std::clamp(static_cast<int>(std::ceil(position - reach)), 0, size - 1);
  const int last = std::clamp(static_cast<int>(std::floor(position + reach)), taps.first,
                              std::min(size, taps.first + Taps::kMax) - 1);
  taps.count = last - taps.first + 1;
  const auto below = [&](double x) { return 0.5 * std::erf((x - position) / (sigma * std::numbers::sqrt2)); };
  double sum = 0, left = below(taps.first - 0.5);
  std::array<double, Taps::kMax> weight{};
  for (int i = 0; i < taps.count; ++i) {
    const double right = below(taps.first + i + 0.5);
    sum += weight[i] = right - left;
    left = right;
  }
  for (int i = 0; i < taps.count; ++i)
    taps.weight[i] = sum > 0 ? static_cast<float>(weight[i] / sum) : 1.0F / static_cast<float>(taps.count);
  return taps;
}

}  // namespace symrig::calibration
