// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/map_shape.hpp"

#include "calibration/registration/perspective_map.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace symrig {

using calibration::PerspectiveMap;
using calibration::SeenCoordinate;

namespace {

/// Points along the longer side of the picture.
constexpr int kLattice = 32;

}  // namespace

Grid shape_lattice(Grid camera, int longer_side) {
  const double most = std::max(camera.rows, camera.cols);
  const auto points = [most, longer_side](int side) {
    return std::max(2, static_cast<int>(std::lround(longer_side * side / most)));
  };
  return {points(camera.rows), points(camera.cols)};
}

MapShape shape_of(Grid camera, const Look& look, Grid cells) {
  MapShape shape;
  const Grid lattice = shape_lattice(camera, kLattice);
  const auto at = [&](int row, int col) {
    return Point{(row + 0.5) * camera.rows / lattice.rows, (col + 0.5) * camera.cols / lattice.cols};
  };
  shape.rest = Image<float>(lattice, 3);
  std::vector<SeenCoordinate> seen;
  for (int row = 0; row < lattice.rows; ++row)
    for (int col = 0; col < lattice.cols; ++col) {
      const Point from = at(row, col), to = look(from);
      if (!(to.row >= 0 && to.col >= 0 && to.row <= cells.rows && to.col <= cells.cols)) continue;
      seen.push_back({from, StripeAxis::rows, to.row});
      seen.push_back({from, StripeAxis::columns, to.col});
      shape.rest.at(row, col, 2) = 1;
    }
  PerspectiveMap map(camera);
  map.fit(seen);
  for (int row = 0; row < lattice.rows; ++row)
    for (int col = 0; col < lattice.cols; ++col) {
      if (shape.rest.at(row, col, 2) == 0) continue;
      const Point to = look(at(row, col)), straight = map.look(at(row, col));
      shape.rest.at(row, col, 0) = static_cast<float>(to.row - straight.row);
      shape.rest.at(row, col, 1) = static_cast<float>(to.col - straight.col);
    }
  map.describe(cells, shape);
  shape.parallax = calibration::parallax_of(shape.rest);
  return shape;
}

}  // namespace symrig
