// SPDX-License-Identifier: Apache-2.0
// Cameras that see cells, and what they see.
#pragma once

#include "symrig/calibration/cell_weights.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace symrig::test {

/// A camera with this many pixels along the side of a cell, turned, and shifted in cells.
inline CornerMap corners_of(Grid camera, double per_cell, double degrees, Point shift) {
  CornerMap corners({camera.rows + 1, camera.cols + 1}, 2);
  const double c = std::cos(degrees * std::numbers::pi / 180), s = std::sin(degrees * std::numbers::pi / 180);
  for (int row = 0; row <= camera.rows; ++row)
    for (int col = 0; col <= camera.cols; ++col) {
      corners.at(row, col, 0) = (c * row + s * col) / per_cell + shift.row;
      corners.at(row, col, 1) = (c * col - s * row) / per_cell + shift.col;
    }
  return corners;
}

inline Radiance photograph(Grid camera, int channels, float value) {
  return {Image<float>(camera, channels, value), Image<float>(camera, channels, 1e-4F),
          Image<std::uint8_t>(camera, channels, 1)};
}

/// The value of a function of the cells' coordinates in the middle of each camera pixel.
template <class Function>
Radiance seen(const CornerMap& corners, Function function) {
  const Grid camera{corners.grid().rows - 1, corners.grid().cols - 1};
  Radiance out = photograph(camera, 1, 0);
  for (int row = 0; row < camera.rows; ++row)
    for (int col = 0; col < camera.cols; ++col) {
      Point middle;
      for (const Point& p : outline_of(corners, row, col))
        middle = {middle.row + p.row / 4, middle.col + p.col / 4};
      out.mean.at(row, col) = static_cast<float>(function(middle));
    }
  return out;
}

inline CellWeights weights_of(Grid cells, const CornerMap& corners, const Radiance& flood,
                              const WeightOptions& options = {}) {
  auto weights = CellWeights::make(cells, {&corners, 1}, flood, options);
  EXPECT_TRUE(weights.ok()) << weights.error().line();
  return *std::move(weights);
}

}  // namespace symrig::test
