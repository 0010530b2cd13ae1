// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/fitting/spline_surface.hpp"
#include "symrig/calibration/camera_map.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace symrig {

/// Where camera pixels look: a row and a column of the cells.
struct CameraMap::Surfaces {
  calibration::SplineSurface row, col;
};

namespace calibration {

/// rms width of the blur of an edge that is wider than a pixel: its slope is that of a Gaussian.
inline double blur_of_edge(double edge_width, double pixel_width) {
  const double square = edge_width * edge_width - pixel_width * pixel_width;
  return std::sqrt(std::max(0.0, square) / (2 * std::numbers::pi));
}

}  // namespace calibration
}  // namespace symrig
