// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/outline.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::calibration {

/// A camera pixel and a cell that it overlaps.
struct CellOverlap {
  std::uint32_t cell, pixel;
  float area;
  bool core;
  float row, col;             ///< the middle of the overlap, from the middle of the cell
  float whole;                ///< area of the pixel, inside and outside of the cells
  bool first_row, first_col;  ///< of the cells that the pixel sees
  bool two;                   ///< it sees at most two rows and two columns
  double share() const { return static_cast<double>(area / whole); }  ///< of the pixel
};

/// All overlaps, ordered by cell, then by pixel. corners: of the camera's pixels, on the cells. margin: of a
/// core from the border of its cell [cells].
std::vector<CellOverlap> cell_overlaps(Grid cells, const CornerMap& corners, double margin);

/// How much of a pixel belongs to a cell: by its light if the shares are known, else by its area.
class LightParts {
 public:
  /// shares: as for CellWeights::make(), or none. map: index of the corner map.
  LightParts(const Image<float>* shares, std::size_t map) {
    if (shares == nullptr) return;
    row_ = shares->plane(2 * static_cast<int>(map));
    col_ = shares->plane(2 * static_cast<int>(map) + 1);
  }

  double area(const CellOverlap& p) const {
    if (row_.empty() || !p.two) return static_cast<double>(p.area);
    const auto row = static_cast<double>(row_[p.pixel]), col = static_cast<double>(col_[p.pixel]);
    if (row < 0 || col < 0) return static_cast<double>(p.area);
    return static_cast<double>(p.whole) * (p.first_row ? row : 1 - row) * (p.first_col ? col : 1 - col);
  }

 private:
  std::span<const float> row_, col_;
};

}  // namespace symrig::calibration
