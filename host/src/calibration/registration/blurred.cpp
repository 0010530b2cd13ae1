// SPDX-License-Identifier: Apache-2.0
#include "calibration/registration/blurred.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

/// Below this variance, samples of a Gaussian have another variance than it. Then three taps have the right
/// one.
constexpr double kNarrow = 0.5;

/// Taps −n … n with sum 1 and the variance width².
std::vector<float> kernel(double width) {
  const double variance = width * width;
  if (variance <= kNarrow)
    return {static_cast<float>(variance / 2), static_cast<float>(1 - variance),
            static_cast<float>(variance / 2)};
  const int reach = static_cast<int>(std::ceil(3.5 * width));
  std::vector<double> taps;
  double sum = 0;
  for (int k = -reach; k <= reach; ++k) sum += taps.emplace_back(std::exp(-0.5 * k * k / variance));
  std::vector<float> out;
  out.reserve(taps.size());
  for (const double tap : taps) out.push_back(static_cast<float>(tap / sum));
  return out;
}

/// out = taps * in along the rows, then along the columns. Nothing comes from beyond the border.
void convolve(Grid grid, std::span<const float> taps, std::span<float> plane) {
  const int reach = static_cast<int>(taps.size()) / 2;
  const auto cols = static_cast<std::size_t>(grid.cols);
  std::vector<float> across(plane.size());
  tbb::parallel_for(0, grid.rows, [&](int row) {
    const std::span<const float> from = plane.subspan(static_cast<std::size_t>(row) * cols, cols);
    const std::span<float> to = std::span(across).subspan(static_cast<std::size_t>(row) * cols, cols);
    for (int k = -reach; k <= reach; ++k) {
      const float tap = taps[static_cast<std::size_t>(k + reach)];
      const int begin = std::max(0, -k), end = grid.cols - std::max(0, k);
      for (int col = begin; col < end; ++col)
        to[static_cast<std::size_t>(col)] += tap * from[static_cast<std::size_t>(col + k)];
    }
  });
  tbb::parallel_for(0, grid.rows, [&](int row) {
    const std::span<float> to = plane.subspan(static_cast<std::size_t>(row) * cols, cols);
    std::ranges::fill(to, 0.F);
    for (int k = std::max(-reach, -row); k <= std::min(reach, grid.rows - 1 - row); ++k) {
      const float tap = taps[static_cast<std::size_t>(k + reach)];
      const std::span<const float> from =
          std::span<const float>(across).subspan(static_cast<std::size_t>(row + k) * cols, cols);
      for (std::size_t col = 0; col < cols; ++col) to[col] += tap * from[col];
    }
  });
}

}  // namespace

Radiance blurred(const Radiance& photograph, double width) {
  const Grid grid = photograph.mean.grid();
  const std::vector<float> taps = kernel(width);
  Radiance out = photograph;
  std::vector<float> share(static_cast<std::size_t>(grid.size()));
  for (int c = 0; c < photograph.mean.channels(); ++c) {
    // Means and variances are 0 where a pixel is not valid.
    const auto mean = out.mean.plane(c), variance = out.variance.plane(c);
    const auto valid = out.valid.plane(c);
    std::ranges::transform(valid, share.begin(), [](std::uint8_t v) { return v ? 1.F : 0.F; });
    convolve(grid, taps, mean);
    convolve(grid, taps, variance);
    convolve(grid, taps, share);
    for (std::size_t i = 0; i < share.size(); ++i) {
      const float scale = valid[i] && share[i] > 0 ? 1 / share[i] : 0;
      mean[i] *= scale;
      variance[i] *= scale;
    }
  }
  return out;
}

}  // namespace symrig::calibration
