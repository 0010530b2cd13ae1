// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/image.hpp"

#include <array>
#include <vector>

namespace symrig {

/// A point of a picture. Pixel (i, j) covers [i, i + 1) × [j, j + 1).
struct Point {
  double row = 0, col = 0;
};

/// The corners of a quadrangle, around it: a pixel of one picture on the grid of another.
using Outline = std::array<Point, 4>;

/// A pixel of a grid, and the part of an outline inside it.
struct Overlap {
  int row = 0, col = 0;
  double area = 0;  ///< [pixels]
  Point middle;     ///< centroid of the part
};

/// [pixels]
double area_of(const Outline& outline);

/// Replaces `overlaps` by the areas of a convex outline inside the pixels of a grid. They are exact: the
/// lines of the grid cut the outline [Sutherland74]. What lies outside the grid is left out.
void cut_outline(const Outline& outline, Grid grid, std::vector<Overlap>& overlaps);

/// Where the corners of a picture's pixels lie on another grid: corner (i, j) is the upper left one of pixel
/// (i, j). One row and one column more than the picture has; channel 0 is the row on the other grid, channel
/// 1 the column.
using CornerMap = Image<double>;

/// The outline of pixel (row, col).
Outline outline_of(const CornerMap& corners, int row, int col);

}  // namespace symrig
