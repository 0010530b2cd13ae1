// SPDX-License-Identifier: Apache-2.0
#include "calibration/registration/cell_overlaps.hpp"

#include <algorithm>

#include <tbb/parallel_for.h>

namespace symrig::calibration {

namespace {

/// A pixel that sees more cells than this along an axis tells nothing of any of them. So a map that is wrong
/// costs no more than a right one.
bool is_narrow(const Outline& outline) {
  constexpr double kWidest = 8;
  const auto [top, bottom] = std::ranges::minmax(outline, {}, &Point::row);
  const auto [left, right] = std::ranges::minmax(outline, {}, &Point::col);
  return bottom.row - top.row <= kWidest && right.col - left.col <= kWidest;
}

bool is_core(const Outline& outline, int row, int col, double margin) {
  return std::ranges::all_of(outline, [&](const Point& p) {
    return p.row >= row + margin && p.row <= row + 1 - margin && p.col >= col + margin &&
           p.col <= col + 1 - margin;
  });
}

}  // namespace

std::vector<CellOverlap> cell_overlaps(Grid cells, const CornerMap& corners, double margin) {
  const Grid camera{corners.grid().rows - 1, corners.grid().cols - 1};
  std::vector<std::vector<CellOverlap>> of_row(static_cast<std::size_t>(camera.rows));
  tbb::parallel_for(0, camera.rows, [&](int row) {
    std::vector<Overlap> scratch;
    for (int col = 0; col < camera.cols; ++col) {
      const Outline outline = outline_of(corners, row, col);
      if (!is_narrow(outline)) continue;
      cut_outline(outline, cells, scratch);
      const auto pixel = static_cast<std::uint32_t>(std::int64_t{row} * camera.cols + col);
      if (scratch.empty()) continue;
      const double whole = area_of(outline);
      Overlap first = scratch.front(), last = first;
      for (const Overlap& o : scratch) {
        first.row = std::min(first.row, o.row), first.col = std::min(first.col, o.col);
        last.row = std::max(last.row, o.row), last.col = std::max(last.col, o.col);
      }
      const bool two = last.row - first.row <= 1 && last.col - first.col <= 1;
      for (const Overlap& o : scratch)
        of_row[static_cast<std::size_t>(row)].push_back(
            {.cell = static_cast<std::uint32_t>(std::int64_t{o.row} * cells.cols + o.col),
             .pixel = pixel,
             .area = static_cast<float>(o.area),
             .core = scratch.size() == 1 && is_core(outline, o.row, o.col, margin),
             .row = static_cast<float>(o.middle.row - o.row - 0.5),
             .col = static_cast<float>(o.middle.col - o.col - 0.5),
             .whole = static_cast<float>(whole),
             .first_row = o.row == first.row,
             .first_col = o.col == first.col,
             .two = two});
    }
  });

  // Counting sort by cell; pixels come in order already.
  const auto count = static_cast<std::size_t>(cells.size());
  std::vector<std::size_t> next(count + 1);
  for (const auto& parts : of_row)
    for (const CellOverlap& part : parts) ++next[part.cell + 1];
  for (std::size_t i = 0; i < count; ++i) next[i + 1] += next[i];
  std::vector<CellOverlap> sorted(next.back());
  for (const auto& parts : of_row)
    for (const CellOverlap& part : parts) sorted[next[part.cell]++] = part;
  return sorted;
}

}  // namespace symrig::calibration
