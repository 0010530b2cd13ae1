// SPDX-License-Identifier: Apache-2.0
#include "calibration/registration/view_by_view.hpp"

#include <algorithm>
#include <utility>

namespace symrig::calibration {
namespace {

symrig::Tile tile_of(Grid grid, ViewLayout views, std::size_t view) {
  const int index = static_cast<int>(view);
  return views.tile(grid, {index / views.cols, index % views.cols});
}

bool is_dark(const Pattern& pattern) {
  return std::ranges::all_of(pattern.values(), [](float v) { return v == 0; });
}

bool add_up_to(const Pattern& a, const Pattern& b, const Pattern& whole) {
  for (std::size_t i = 0; i < whole.values().size(); ++i)
    if (a.values()[i] + b.values()[i] != whole.values()[i]) return false;
  return true;
}

/// Without light, of the same pixels.
Radiance dark_like(const Radiance& one) {
  Radiance dark = one;
  std::ranges::fill(dark.mean.values(), 0.F);
  std::ranges::fill(dark.variance.values(), 0.F);
  return dark;
}

Radiance less(const Radiance& whole, const Radiance& part) {
  Radiance rest = whole;
  for (std::size_t i = 0; i < rest.mean.values().size(); ++i) {
    rest.valid.values()[i] &= part.valid.values()[i];
    const bool valid = rest.valid.values()[i] != 0;
    rest.mean.values()[i] = valid ? rest.mean.values()[i] - part.mean.values()[i] : 0.F;
    rest.variance.values()[i] = valid ? rest.variance.values()[i] + part.variance.values()[i] : 0.F;
  }
  return rest;
}

}  // namespace

Pattern inside_view(const Pattern& pattern, ViewLayout views, std::size_t view) {
  const symrig::Tile tile = tile_of(pattern.grid(), views, view);
  Pattern inside(pattern.grid());
  for (int row = tile.row; row < tile.row + tile.grid.rows; ++row)
    for (int col = tile.col; col < tile.col + tile.grid.cols; ++col)
      inside.at(row, col) = pattern.at(row, col);
  return inside;
}

ViewByView::ViewByView(Probe& rig) : rig_(rig), seen_(static_cast<std::size_t>(rig.views().count())) {}

Result<Radiance> ViewByView::photograph(const Pattern& pattern) {
  SYMRIG_TRY(auto one, rig_.measure({&pattern, 1}));
  return std::move(one.front());
}

Result<const Radiance*> ViewByView::whole_of(std::size_t view) {
  std::optional<Radiance>& whole = seen_[view].whole;
  if (!whole) {
    SYMRIG_TRY(whole, photograph(inside_view(Pattern(rig_.grid(), 1, 1.F), rig_.views(), view)));
  }
  return &*whole;
}

Result<Radiance> ViewByView::measure_view(const Pattern& pattern, std::size_t view) {
  const Pattern inside = inside_view(pattern, rig_.views(), view);
  const Pattern all = inside_view(Pattern(rig_.grid(), 1, 1.F), rig_.views(), view);
  SYMRIG_TRY(const Radiance* whole, whole_of(view));
  if (is_dark(inside)) return dark_like(*whole);
  if (std::ranges::equal(inside.values(), all.values())) return *whole;
  std::optional<Photographed>& last = seen_[view].last;
  if (last && add_up_to(inside, last->pattern, all)) return less(*whole, last->photograph);
  SYMRIG_TRY(Radiance seen, photograph(inside));
  last = Photographed{inside, seen};
  return seen;
}

Result<std::vector<Radiance>> ViewByView::measure(const Pattern& pattern) {
  std::vector<Radiance> by_view;
  by_view.reserve(views());
  for (std::size_t view = 0; view < views(); ++view) {
    SYMRIG_TRY(Radiance one, measure_view(pattern, view));
    by_view.push_back(std::move(one));
  }
  return by_view;
}

}  // namespace symrig::calibration
