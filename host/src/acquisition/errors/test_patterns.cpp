// SPDX-License-Identifier: Apache-2.0
// The patterns that errors and reports are made with.
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/base/random.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace symrig {
namespace {

/// Value noise of one octave: random heights on a lattice of `cells` steps across the longer side,
/// cosine-interpolated.
void add_octave(Image<float>& picture, int cells, float weight, unsigned seed) {
  const Grid grid = picture.grid();
  const double step = static_cast<double>(std::max(grid.rows, grid.cols)) / cells;
  const int side = cells + 2;
  std::vector<float> lattice(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
  Random random(seed * 1000003ULL + static_cast<unsigned>(cells));
  for (float& h : lattice) h = static_cast<float>(random.uniform());
  const auto height = [&](int y, int x) {
    return lattice[static_cast<std::size_t>(y) * static_cast<std::size_t>(side) +
                   static_cast<std::size_t>(x)];
  };
  const auto smooth = [](double t) { return static_cast<float>(0.5 - 0.5 * std::cos(3.14159265358979 * t)); };
  for (int row = 0; row < grid.rows; ++row) {
    const int y = static_cast<int>(row / step);
    const float v = smooth(row / step - y);
    for (int col = 0; col < grid.cols; ++col) {
      const int x = static_cast<int>(col / step);
      const float u = smooth(col / step - x);
      const float top = height(y, x) * (1 - u) + height(y, x + 1) * u;
      const float bottom = height(y + 1, x) * (1 - u) + height(y + 1, x + 1) * u;
      picture.at(row, col) += weight * (top * (1 - v) + bottom * v);
    }
  }
}

}  // namespace

Image<float> bar_pattern(Grid grid) {
  Image<float> pattern(grid);
  const int first = grid.cols * 5 / 16;
  const int last = std::max(first + 1, grid.cols * 7 / 16);
  for (int row = 0; row < grid.rows; ++row)
    for (int col = first; col < last; ++col) pattern.at(row, col) = 1;
  return pattern;
}

Image<float> natural_pattern(Grid grid, unsigned seed) {
  Image<float> pattern(grid);
  for (const int cells : {3, 7, 17, 41}) add_octave(pattern, cells, 1.0F / static_cast<float>(cells), seed);
  const auto [low, high] = std::minmax_element(pattern.values().begin(), pattern.values().end());
  const float floor = *low;
  const float span = *high > *low ? *high - *low : 1;
  for (float& v : pattern.values()) v = (v - floor) / span;
  return pattern;
}

Image<float> random_pattern(Grid grid, unsigned seed) {
  Image<float> pattern(grid);
  Random random(seed);
  for (float& v : pattern.values()) v = random.sign() > 0 ? 1.0F : 0.0F;
  return pattern;
}

}  // namespace symrig
