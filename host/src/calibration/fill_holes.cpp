// SPDX-License-Identifier: Apache-2.0
#include "calibration/raw_map.hpp"
#include "symrig/base/quantile.hpp"

#include <optional>
#include <vector>

#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

/// Median position of the masked pixels of the neighbourhood.
std::optional<double> median_of(const Image<float>& position, const Image<std::uint8_t>& mask, int row,
                                int col, const Neighbourhood& hood) {
  const Grid grid = mask.grid();
  std::vector<float> values;
  for (int i = -hood.reach; i <= hood.reach; ++i) {
    for (int j = -hood.reach; j <= hood.reach; ++j) {
      const int r = row + i * hood.spacing, c = col + j * hood.spacing;
      if (r >= 0 && r < grid.rows && c >= 0 && c < grid.cols && mask.at(r, c))
        values.push_back(position.at(r, c));
    }
  }
  if (static_cast<int>(values.size()) < hood.least) return std::nullopt;
  return static_cast<double>(median(values));
}

std::optional<float> foretold(const RawMap& map, std::size_t axis, int row, int col,
                              const Neighbourhood& hood) {
  const auto centre = median_of(map.position[axis], map.mask, row, col, hood);
  if (!centre) return std::nullopt;
  const Plane plane =
      fit_plane(map.position[axis], map.mask, row, col, *centre, hood, [](int, int) { return true; });
  if (plane.support == 0) return std::nullopt;
  return static_cast<float>(plane.value);
}

/// One pass over all holes. New positions are used from the next pass on.
void fill_once(RawMap& map, const Image<std::uint8_t>& wanted, const Neighbourhood& hood) {
  RawMap filled = map;
  tbb::parallel_for(0, map.grid().rows, [&](int row) {
    for (int col = 0; col < map.grid().cols; ++col) {
      if (map.mask.at(row, col) || !wanted.at(row, col)) continue;
      const auto x = foretold(map, 0, row, col, hood), y = foretold(map, 1, row, col, hood);
      if (!x || !y) continue;
      filled.position[0].at(row, col) = *x;
      filled.position[1].at(row, col) = *y;
      filled.mask.at(row, col) = 1;
    }
  });
  map = std::move(filled);
}

}  // namespace

void fill_holes(RawMap& map, const Image<std::uint8_t>& wanted) {
  const double scale = typical_scale(map);
  for (int spacing = 2; spacing <= 16; spacing *= 2)
    fill_once(map, wanted, {.reach = 3, .spacing = spacing, .scale = scale, .least = 12});
}

}  // namespace symrig::calibration
