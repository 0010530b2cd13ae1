// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/alignment_summary.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace symrig {
namespace {

/// To the right, then clockwise.
constexpr std::array<const char*, 8> kArrows{"→", "↘", "↓", "↙", "←", "↖", "↑", "↗"};
constexpr std::array<const char*, 8> kLongArrows{"⇒", "⇘", "⇓", "⇙", "⇐", "⇖", "⇑", "⇗"};
/// Of the longest: shorter ones are a point, and longer ones a double arrow.
constexpr double kPoint = 0.25, kLong = 0.6;

const char* arrow(double row, double col, double longest) {
  const double length = std::hypot(row, col);
  if (length < kPoint * longest) return "·";
  const auto eighth =
      static_cast<std::size_t>(std::lround(std::atan2(row, col) / (std::numbers::pi / 4)) + 8) % 8;
  return length < kLong * longest ? kArrows[eighth] : kLongArrows[eighth];
}

}  // namespace

std::string left_over_picture(const Alignment& alignment, std::size_t columns) {
  const Image<float>& rest = alignment.shape.rest;
  const Grid grid = rest.grid();
  const auto at = [&](int row, int col, int k) { return static_cast<double>(rest.at(row, col, k)); };
  double longest = 0;
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col)
      longest = std::max(longest, std::hypot(at(row, col, 0), at(row, col, 1)));
  // A character is twice as high as wide, so each point has a space behind it.
  const std::size_t wide = 2 * static_cast<std::size_t>(grid.cols);
  const int step = static_cast<int>(wide / std::max<std::size_t>(columns, 8)) + 1;
  std::string picture = fmt::format(
      "\nleft over of the map, by part of the camera's picture; the longest is {:.3f} cells\n", longest);
  for (int row = 0; row < grid.rows; row += step) {
    for (int col = 0; col < grid.cols; col += step)
      picture +=
          at(row, col, 2) == 0 ? "  " : std::string(arrow(at(row, col, 0), at(row, col, 1), longest)) + " ";
    picture += "\n";
  }
  return picture;
}

}  // namespace symrig
