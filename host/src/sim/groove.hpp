// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/grid.hpp"

#include <numbers>
#include <vector>

namespace symrig::sim {

/// Two planes that meet at a right angle in a vertical crease, seen by an orthographic rig along the
/// bisector. Lengths in pixels: column j has its centre at x = j + ½, the crease lies at x = 0.47 · cols
/// (no block boundary), and a point at distance s from the crease has depth s behind the rig's focal plane.
struct Groove {
  explicit Groove(Grid grid_);

  Grid grid;
  double crease;                 ///< x of the crease [px]
  int left_cols = 0;             ///< columns [0, left_cols) are the left plane
  std::vector<double> distance;  ///< of each column's centre from the crease [px]

  int right_cols() const { return grid.cols - left_cols; }
};

/// Both planes are inclined by 45° to the rig: a unit of projector light per pixel is spread on √2 px².
inline constexpr double kForeshortening = 1 / std::numbers::sqrt2;

/// Point form factor between a point s from the crease on one plane and a point t from it on the other,
/// dy apart along it: F = cos θ cos θ' dA / (π r²) = c s t / (2s² + 2t² + dy²)², c = 2√2/π, with
/// cos θ = √2 t / r, cos θ' = √2 s / r and dA = √2 px². Pixel centres on the two planes are at least one
/// pixel apart (r ≥ 1), so F ≤ 0.23 without any clamp. units: share of the light that leaves.
double point_form_factor(double s, double t, double dy);
inline constexpr double kFormFactorScale = 2 * std::numbers::sqrt2 / std::numbers::pi;

}  // namespace symrig::sim
