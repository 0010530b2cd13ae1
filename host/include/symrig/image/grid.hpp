// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace symrig {

/// A pixel grid of any size: rows × columns (n_y × n_x). Pixel (row, col) has raster index row * cols + col.
struct Grid {
  int rows = 0;
  int cols = 0;

  constexpr std::int64_t size() const { return std::int64_t{rows} * cols; }
  constexpr bool operator==(const Grid&) const = default;
  constexpr bool valid() const { return rows > 0 && cols > 0 && size() <= (std::int64_t{1} << 30); }
};

/// "128x96": rows x columns, as on the command line.
inline std::string to_string(Grid grid) {
  return std::to_string(grid.rows) + "x" + std::to_string(grid.cols);
}

/// One of several coaxial views, counted from the top left one.
struct View {
  int row = 0, col = 0;
  constexpr bool operator==(const View&) const = default;
};

/// A rectangle of pixels of a grid.
struct Tile {
  int row = 0, col = 0;
  Grid grid;
  constexpr bool operator==(const Tile&) const = default;
};

/// rows × cols coaxial views that tile one grid. They come from a mirror array or several projector-camera
/// pairs [Garg06 Fig. 5, 7]. Of n pixels along an axis with V views, view k has [⌊k n / V⌋, ⌊(k + 1) n / V⌋).
/// So tiles differ by at most one pixel if n is not divisible by V.
struct ViewLayout {
  int rows = 1, cols = 1;

  constexpr bool operator==(const ViewLayout&) const = default;
  constexpr std::int64_t count() const { return std::int64_t{rows} * cols; }
  constexpr bool single() const { return rows == 1 && cols == 1; }
  /// Every view has at least one pixel.
  constexpr bool fits(Grid grid) const {
    return rows >= 1 && cols >= 1 && rows <= grid.rows && cols <= grid.cols;
  }
  constexpr bool has(View view) const {
    return view.row >= 0 && view.row < rows && view.col >= 0 && view.col < cols;
  }
  /// The pixels of one view.  needs: fits(grid), has(view).
  constexpr Tile tile(Grid grid, View view) const {
    const int top = start(grid.rows, rows, view.row);
    const int left = start(grid.cols, cols, view.col);
    return {
        top, left, {start(grid.rows, rows, view.row + 1) - top, start(grid.cols, cols, view.col + 1) - left}};
  }
  /// The view that a pixel belongs to.  needs: fits(grid), the pixel lies in the grid.
  constexpr View view_of(Grid grid, int row, int col) const {
    return {index(grid.rows, rows, row), index(grid.cols, cols, col)};
  }

 private:
  static constexpr int start(std::int64_t n, std::int64_t views, std::int64_t k) {
    return static_cast<int>(k * n / views);
  }
  static constexpr int index(std::int64_t n, std::int64_t views, std::int64_t pixel) {
    return static_cast<int>(((pixel + 1) * views - 1) / n);
  }
};

/// "2x3": rows x columns of views.
inline std::string to_string(ViewLayout views) {
  return std::to_string(views.rows) + "x" + std::to_string(views.cols);
}

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
