// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/image.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace symrig {

/// How a gain of optics changes over a picture: along y, x, r² and r⁴, with r = 1 in the corners. Vignetting
/// and solid angles are even in r; a tilt is along y and x.
constexpr int kGainShapes = 4;
using GainShapes = std::array<double, kGainShapes>;

/// The shapes at the middle of each pixel, by rows, each less its mean over the grid.
inline std::vector<GainShapes> gain_shapes(Grid grid) {
  std::vector<GainShapes> shapes;
  shapes.reserve(static_cast<std::size_t>(grid.size()));
  const double half = 0.5 * std::hypot(grid.rows, grid.cols);
  GainShapes mean{};
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) {
      const double y = (row + 0.5 - 0.5 * grid.rows) / half, x = (col + 0.5 - 0.5 * grid.cols) / half;
      const double square = y * y + x * x;
      shapes.push_back({y, x, square, square * square});
      for (int s = 0; s < kGainShapes; ++s) mean[s] += shapes.back()[s];
    }
  for (GainShapes& one : shapes)
    for (int s = 0; s < kGainShapes; ++s) one[s] -= mean[s] / static_cast<double>(shapes.size());
  return shapes;
}

}  // namespace symrig
