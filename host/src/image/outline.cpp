// SPDX-License-Identifier: Apache-2.0
#include "symrig/image/outline.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace symrig {
namespace {

/// A polygon. Four corners, and at most two more for each of four cuts.
struct Polygon {
  std::array<Point, 12> corner;
  std::size_t corners = 0;

  void add(Point p) { corner[corners++] = p; }
  struct Part {
    double area;
    Point middle;
  };
  /// Sums over the triangles at the first corner, so that large coordinates do not cancel.
  Part part() const {
    double twice = 0, row = 0, col = 0;
    for (std::size_t i = 1; i + 1 < corners; ++i) {
      const Point a{corner[i].row - corner[0].row, corner[i].col - corner[0].col};
      const Point b{corner[i + 1].row - corner[0].row, corner[i + 1].col - corner[0].col};
      const double triangle = a.col * b.row - b.col * a.row;
      twice += triangle;
      row += triangle * (a.row + b.row) / 3;
      col += triangle * (a.col + b.col) / 3;
    }
    const double share = twice != 0 ? 1 / twice : 0;
    return {0.5 * std::abs(twice), {corner[0].row + row * share, corner[0].col + col * share}};
  }
};

/// The part of a polygon where sign · (axis − at) ≥ 0 [Sutherland74].
Polygon cut(const Polygon& whole, double Point::*axis, double at, double sign) {
  Polygon part;
  for (std::size_t i = 0; i < whole.corners; ++i) {
    const Point &a = whole.corner[i], &b = whole.corner[(i + 1) % whole.corners];
    const double from_a = sign * (a.*axis - at), from_b = sign * (b.*axis - at);
    if (from_a >= 0) part.add(a);
    if ((from_a >= 0) == (from_b >= 0)) continue;
    const double share = from_a / (from_a - from_b);
    part.add({a.row + share * (b.row - a.row), a.col + share * (b.col - a.col)});
  }
  return part;
}

/// The grid lines between which a polygon lies along one axis, within [0, size].
struct LineRange {
  int begin, end;
};
LineRange range_of(const Polygon& polygon, double Point::*axis, int size) {
  double low = polygon.corner[0].*axis, high = low;
  for (std::size_t i = 1; i < polygon.corners; ++i) {
    low = std::min(low, polygon.corner[i].*axis);
    high = std::max(high, polygon.corner[i].*axis);
  }
  const auto line = [size](double at) {
    return static_cast<int>(std::clamp(at, 0.0, static_cast<double>(size)));
  };
  return {line(std::floor(low)), line(std::ceil(high))};
}

Polygon strip(const Polygon& whole, double Point::*axis, int line) {
  return cut(cut(whole, axis, line, 1), axis, line + 1, -1);
}

}  // namespace

double area_of(const Outline& outline) {
  Polygon polygon;
  for (const Point& p : outline) polygon.add(p);
  return polygon.part().area;
}

void cut_outline(const Outline& outline, Grid grid, std::vector<Overlap>& overlaps) {
  overlaps.clear();
  Polygon whole;
  for (const Point& p : outline) whole.add(p);
  const LineRange rows = range_of(whole, &Point::row, grid.rows);
  for (int row = rows.begin; row < rows.end; ++row) {
    const Polygon across = strip(whole, &Point::row, row);
    if (across.corners < 3) continue;
    const LineRange cols = range_of(across, &Point::col, grid.cols);
    for (int col = cols.begin; col < cols.end; ++col)
      if (const auto part = strip(across, &Point::col, col).part(); part.area > 0)
        overlaps.push_back({row, col, part.area, part.middle});
  }
}

Outline outline_of(const CornerMap& corners, int row, int col) {
  const auto at = [&](int r, int c) { return Point{corners.at(r, c, 0), corners.at(r, c, 1)}; };
  return {at(row, col), at(row, col + 1), at(row + 1, col + 1), at(row + 1, col)};
}

}  // namespace symrig
