// SPDX-License-Identifier: Apache-2.0
#include "calibration/registration/one_view.hpp"

#include <utility>

namespace symrig::calibration {

Result<std::vector<Radiance>> OneView::measure(std::span<const Pattern> patterns) {
  SYMRIG_CHECK(check_patterns(*this, patterns));
  std::vector<Pattern> inside;
  inside.reserve(patterns.size());
  for (const Pattern& pattern : patterns) {
    Pattern& whole = inside.emplace_back(rig_.grid());
    for (int row = 0; row < tile_.grid.rows; ++row)
      for (int col = 0; col < tile_.grid.cols; ++col)
        whole.at(tile_.row + row, tile_.col + col) = pattern.at(row, col);
  }
  SYMRIG_TRY(auto photographs, rig_.measure(inside));
  for (Radiance& one : photographs) one = of_view(std::move(one));
  return photographs;
}

Radiance OneView::of_view(Radiance photograph) const {
  if (ghost_) photograph = (*ghost_)(photograph);
  own_.leave_only(view_, photograph);
  return photograph;
}

Registration OneView::part_of(const Registration& whole, const Radiance& lit) const {
  Registration part = whole;
  part.cells = tile_.grid;
  const Point corner{static_cast<double>(tile_.row), static_cast<double>(tile_.col)};
  for (CameraMap& map : part.maps)
    map = map.shifted([corner](Point) { return Point{-corner.row, -corner.col}; });
  part.flood = of_view(lit);
  part.ghost = {};
  return part;
}

}  // namespace symrig::calibration
