// SPDX-License-Identifier: Apache-2.0
#include "sim/camera_optics.hpp"

#include "sim/hash.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace symrig::sim {

namespace {

constexpr double kFlareLength = 0.1;  // of the longer side

/// out(i) = (1 − share) in(i + whole) + share in(i + whole + 1) along a line of n samples `stride` apart.
void shift_line(std::span<float> plane, std::size_t first, std::size_t stride, int n, double pixels,
                std::vector<float>& line) {
  const int whole = static_cast<int>(std::floor(pixels));
  const auto share = static_cast<float>(pixels - whole);
  const auto at = [&](int i) {
    return i < 0 || i >= n ? 0.F : plane[first + static_cast<std::size_t>(i) * stride];
  };
  for (int i = 0; i < n; ++i) line[i] = (1 - share) * at(i + whole) + share * at(i + whole + 1);
  for (int i = 0; i < n; ++i) plane[first + static_cast<std::size_t>(i) * stride] = line[i];
}

/// value(i) ← keep · value(i − 1) + (1 − keep) value(i), along both axes.
void trail(Grid grid, float keep, std::span<float> plane) {
  const std::size_t rows = grid.rows;
  const std::size_t cols = grid.cols;
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t col = 0; col < cols; ++col) {
      float& here = plane[row * cols + col];
      here = (1 - keep) * here + (col > 0 ? keep * plane[row * cols + col - 1] : 0.F);
    }
  }
  for (std::size_t i = 0; i < rows * cols; ++i)
    plane[i] = (1 - keep) * plane[i] + (i >= cols ? keep * plane[i - cols] : 0.F);
}

}  // namespace

void shift(Grid grid, double pixels, std::span<float> plane) {
  const std::size_t rows = grid.rows;
  const std::size_t cols = grid.cols;
  std::vector<float> line(std::max(rows, cols));
  for (std::size_t row = 0; row < rows; ++row) shift_line(plane, row * cols, 1, grid.cols, pixels, line);
  for (std::size_t col = 0; col < cols; ++col) shift_line(plane, col, cols, grid.rows, pixels, line);
}

void add_flare(Grid grid, double share, std::span<float> plane) {
  std::vector<float> flare(plane.begin(), plane.end());
  trail(grid, static_cast<float>(std::exp(-1 / (kFlareLength * std::max(grid.rows, grid.cols)))), flare);
  for (std::size_t i = 0; i < flare.size(); ++i)
    plane[i] = static_cast<float>(1 - share) * plane[i] + static_cast<float>(share) * flare[i];
}

Image<std::uint8_t> dead_pixels(Grid grid, double share, std::uint64_t key) {
  if (share <= 0) return {};
  Image<std::uint8_t> dead(grid);
  for (std::size_t i = 0; i < dead.values().size(); ++i)
    dead.values()[i] = unit_double(combine(key, i)) < share ? 1 : 0;
  return dead;
}

}  // namespace symrig::sim
