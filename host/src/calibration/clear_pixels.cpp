// SPDX-License-Identifier: Apache-2.0
#include "calibration/clear_pixels.hpp"

#include "symrig/base/quantile.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace symrig::calibration {
namespace {

/// The range of a pixel's values without the extreme ones.
float range_of(const CodePhotographs& photographs, const std::optional<int>& held_out, std::size_t pixel) {
  std::array<float, 2> low{1e30F, 1e30F}, high{-1e30F, -1e30F};  // the two smallest, the two largest
  for (int k = 0; k < photographs.code.photographs(); ++k) {
    if (k / 2 == held_out) continue;
    const float v = photographs.image(k).values()[pixel];
    if (v < low[1]) low[1] = v;
    if (low[1] < low[0]) std::swap(low[0], low[1]);
    if (v > high[1]) high[1] = v;
    if (high[1] > high[0]) std::swap(high[0], high[1]);
  }
  return high[1] - low[1];
}

}  // namespace

ClearPixels find_clear_pixels(const CodePhotographs& photographs, const std::optional<int>& held_out) {
  constexpr std::size_t kMost = 8'000;
  constexpr double kBright = 0.95;
  constexpr float kClear = 0.25F;
  const Grid grid = photographs.camera();
  const int stride = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(grid.size()) / (4 * kMost))));
  std::vector<std::size_t> candidates;
  std::vector<float> ranges;
  for (int r = 0; r < grid.rows - ClearPixels::kNext; r += stride)
    for (int c = 0; c < grid.cols - ClearPixels::kNext; c += stride) {
      candidates.push_back(static_cast<std::size_t>(r) * static_cast<std::size_t>(grid.cols) +
                           static_cast<std::size_t>(c));
      ranges.push_back(range_of(photographs, held_out, candidates.back()));
    }
  const float least = kClear * quantile(std::vector<float>(ranges), kBright);
  ClearPixels clear;
  double squares = 0;
  const auto all =
      static_cast<std::size_t>(std::ranges::count_if(ranges, [&](float v) { return v > least; }));
  const std::size_t each = all / kMost + 1;
  std::size_t seen = 0;
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    if (!(ranges[k] > least) || seen++ % each != 0) continue;
    clear.at.push_back(candidates[k]);
    squares += std::pow(static_cast<double>(ranges[k]), 2);
  }
  if (!clear.at.empty()) clear.contrast = std::sqrt(squares / static_cast<double>(clear.at.size()));
  return clear;
}

}  // namespace symrig::calibration
