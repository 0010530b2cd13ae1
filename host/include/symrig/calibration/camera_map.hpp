// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"
#include "symrig/image/outline.hpp"

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

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
  double guessed = 0;  ///< share of the picture of the cells where the map is a guess, because it is dark
  Look straight;       ///< the perspective map with its distortion
  /// What is left over, on a lattice over the picture: row and column [cells], and 1 where both are
  /// known.
  Image<float> rest;
};

/// A lattice over the picture, for MapShape::rest.
Grid shape_lattice(Grid camera, int longer_side);

/// look: a smooth function over the camera's picture that sees at least some of the cells. known: where it is
/// more than a guess, in the picture; nothing: everywhere.
MapShape shape_of(Grid camera, const Look& look, Grid cells, const std::function<bool(Point)>& known = {});

/// The numbers of a CameraMap, as a file keeps them. The map of an axis is a sum of bicubic B-splines: the
/// longer side of the picture has `intervals` equal ones, and coefficients are a matrix by rows.
struct CameraMapNumbers {
  Grid camera;
  int intervals = 0;
  std::vector<double> row, col;  ///< coefficients [cells]
  double error = 0, edge_width = 0, outlier_share = 0;
  std::int64_t edges = 0;
};

/// Where each point of the camera's picture looks on the projector's cells, and how well that is known.
class CameraMap {
 public:
  /// fails: bad_value (a number that no map has, or too few coefficients).
  static Result<CameraMap> make(const CameraMapNumbers& numbers);
  CameraMapNumbers numbers() const;

  /// Splines along the longer side of the picture that a fit uses at most. More cost time and gain nothing.
  static constexpr int kMostIntervals = 48;

  /// The point of the cells that a point of the camera's picture sees. [pixels] → [cells]
  Point look(Point camera) const;
  CornerMap corners() const;
  /// The map of a camera that looks beside this one. shift: by how much, at a point of the cells [cells];
  /// smooth over 5 % of the picture.
  CameraMap shifted(const std::function<Point(Point)>& shift) const;

  Grid camera() const { return camera_; }
  /// Camera pixels along the side of a cell, in the middle of the picture.
  double pixels_per_cell() const;
  /// rms error of the map along an axis [cells], over the decoded pixels: half the difference of two maps,
  /// each from half of the edges. It contains noise and texture, not a crease that the smooth map does not
  /// follow.
  double error() const { return error_; }
  /// How far the light of a border between two cells is spread in the picture, along the worse axis [cells]:
  /// the side of a camera pixel if both optics are sharp, and about 2.5 sigmas of their blur if that is
  /// larger.
  double edge_width() const { return edge_width_; }
  /// rms width of the blur of both optics, by the width of edges [cells]; 0 if edges are as sharp as pixels.
  double edge_blur() const;
  /// How far the view moves for a step of one pixel down, and of one to the right, in the middle of the
  /// picture [cells].
  std::array<Point, 2> step() const;
  /// Distance from the nearest affine map, at the middle of each camera pixel that looks at a cell [cells]; 0
  /// elsewhere. Distortion of the lenses, perspective and parallax bend a map.
  Image<float> bend(Grid cells) const;
  /// Edges that the map was fitted to, both axes.
  std::int64_t edges() const { return edges_; }
  /// Share of the edges that the map does not explain: depth edges, mirrors, dead pixels.
  double outlier_share() const { return outlier_share_; }

 private:
  friend class CameraMapFit;
  struct Surfaces;

  Grid camera_;
  std::shared_ptr<const Surfaces> surfaces_;
  double error_ = 0, edge_width_ = 0, outlier_share_ = 0;
  std::int64_t edges_ = 0;
};

/// The map of one channel, and what its stripes tell of the light of pixels that see two cells.
struct CameraLook {
  CameraMap map;
  /// The shares of CellWeights::make, for this channel.
  Image<float> shares;
};

/// Finds the map of a camera from Gray-code photographs of the cells (gray_code_patterns(cells)), one map for
/// each channel.
///
/// Each pixel is decoded first: its cell, from the signs of pattern minus complement. A smooth map through
/// the cells is known to about a fiftieth of a cell. Then the edges count: a pixel across the border of two
/// cells sees both, and its share of each tells where the border crosses it. That is 5 to 25 times as precise
/// as the decoded cells. The map is a spline (bicubic, fourth differences penalised), fitted robustly, so it
/// covers shadows and dark texture. In larger dark parts it is a guess: a perspective map with distortion.
/// Its smoothness is the one that predicts left-out edges best.
/// photographs: one of each pattern, in order; black subtracted.
/// fails: size_mismatch; bad_value (too few pixels see the stripes).
Result<std::vector<CameraLook>> fit_camera_maps(Grid cells, std::span<const Radiance> photographs);

}  // namespace symrig
