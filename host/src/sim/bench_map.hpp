// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/outline.hpp"
#include "symrig/sim/scene.hpp"

#include <array>

namespace symrig::sim {

/// The depth of the scene at a point of the cells, from −½ (nearest) to ½ (farthest). It is continuous.
using Depth = double (*)(Grid cells, Point at);

/// Where each point of the camera's picture looks. It is exact: the tests of a registration compare with it.
///
/// With x the point from the middle of the picture in cells at zoom 1:
///   q = middle + shift + moved + R(turn) x (1 + distortion |x|² / h²) / zoom · (1 + colour_c / h)
/// h: half diagonal of the cells. The point that is seen is p with p + (0, parallax · depth(p)) = q.
class BenchMap {
 public:
  BenchMap(const SceneUri& uri, Depth depth);

  Grid camera() const { return camera_; }
  /// Camera pixels along the side of a cell, in the middle.
  double pixels_per_cell() const { return zoom_ / cells_per_pixel_; }
  /// The point of the cells that a point of the camera's picture sees. moved: shift of the camera along both
  /// axes [cells].
  Point look(Point camera, int channel, double moved) const;

 private:
  Point seen_at(Point q) const;

  Grid cells_, camera_;
  Depth depth_;
  double cells_per_pixel_, half_diagonal_;
  double cos_, sin_, zoom_, distortion_, parallax_;
  Offset shift_;
  std::array<double, 3> magnify_{1, 1, 1};
};

}  // namespace symrig::sim
