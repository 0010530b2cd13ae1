// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/camera_map.hpp"
#include "symrig/calibration/gray_code.hpp"

#include <span>

#include <Eigen/Core>

namespace symrig::calibration {

/// One coordinate of what a point of the camera's picture sees.
struct SeenCoordinate {
  Point at;  ///< [pixels]
  StripeAxis axis = StripeAxis::columns;
  double value = 0;   ///< column or row of the cells
  double weight = 1;  ///< 1 / variance, up to a factor; 0: does not count
};

/// The perspective map with radial distortion of MapShape.
class PerspectiveMap {
 public:
  explicit PerspectiveMap(Grid camera);

  /// The map nearest to the coordinates by least squares, from an affine map. What they do not tell of
  /// perspective and distortion stays 0.
  void fit(std::span<const SeenCoordinate> seen);
  Point look(Point at) const;
  /// Fills in what MapShape says of it.
  void describe(Grid cells, MapShape& shape) const;

 private:
  /// h11 … h32 (h33 = 1) of H, then k. Points of the picture are in half diagonals from its middle.
  using Numbers = Eigen::Matrix<double, 9, 1>;

  Eigen::Vector2d scaled(Point at) const;
  Eigen::Vector2d model(const Eigen::Vector2d& at) const;
  Eigen::Matrix2d perspective_slopes(const Eigen::Vector2d& bent, const Eigen::Vector2d& cell) const;
  Eigen::Matrix2d step_at(const Eigen::Vector2d& at) const;
  Eigen::Matrix<double, 2, 9> slopes(const Eigen::Vector2d& at) const;
  double scale_at(double row, double col) const;

  Point middle_;
  double half_diagonal_;
  Numbers n_ = Numbers::Zero();
};

/// Parallax in what is left over: MapShape::rest.
Parallax parallax_of(const Image<float>& rest);

}  // namespace symrig::calibration
