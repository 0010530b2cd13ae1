// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/outline.hpp"

#include <functional>

namespace symrig {

/// Where a point of the camera's picture looks. [pixels] → [cells]
using Look = std::function<Point(Point)>;

/// What parallax does to a map. Centres of projection that are apart make the map depend on depth: each point
/// is displaced along the line between the centres, near ones more than far ones.
struct Parallax {
  /// From the nearest to the farthest part of the scene: between the quantiles of 5 % and 95 % of the
  /// displacements along `direction` [cells].
  double range = 0;
  Point direction;  ///< unit vector on the cells; (0, 0) if there is nothing left over
  /// rms of what is left over along `direction`, and across it [cells]. Parallax has one direction, so what
  /// is across comes from the lenses.
  double along = 0, across = 0;
};

/// A camera's map, in the terms of whoever sets up the bench: the perspective map with radial distortion that
/// is nearest to it, and what is left over.
///
///   look(u) = H(m + (u − m) (1 + k |u − m|² / h²))
///
/// H: homography, m: middle of the picture, h: half of its diagonal, k: distortion. It is fitted by least
/// squares over the points that look at a cell. A flat scene shows no parallax, because the map of a plane is
/// a homography from any place.
struct MapShape {
  Point shift;      ///< the middle of the picture looks at the middle of the cells plus this [cells]
  double turn = 0;  ///< of the camera's picture against the cells, clockwise [degrees], −180 to 180
  bool mirrored = false;
  double pixels_per_cell = 0;  ///< in the middle of the picture
  /// Scale in the middle of the last column over that in the first one, less 1; and from the first row to the
  /// last one. A camera and a projector that look from one place along one axis have none.
  double keystone_cols = 0, keystone_rows = 0;
  double distortion = 0;  ///< k: positive if the corners look farther out than without it
  Parallax parallax;
  Look straight;  ///< the perspective map with its distortion
  /// What is left over, on a lattice over the picture: row and column [cells], and 1 where both are
  /// known.
  Image<float> rest;
};

/// A lattice over the picture, for MapShape::rest.
Grid shape_lattice(Grid camera, int longer_side);

/// look: a smooth function over the camera's picture that sees at least some of the cells.
MapShape shape_of(Grid camera, const Look& look, Grid cells);

}  // namespace symrig
