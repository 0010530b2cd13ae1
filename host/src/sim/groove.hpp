// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/grid.hpp"

#include <numbers>
#include <vector>

namespace symrig::sim {

/// Two planes that meet at a right angle in a vertical crease. An orthographic rig looks along the bisector.
/// Lengths are in pixels: column j has its centre at x = j + ½. The crease is at x = 0.47 · cols, so that it
/// is no block boundary. A point at distance s from the crease is at depth s behind the rig's focal plane.
struct Groove {
  explicit Groove(Grid grid_);

  Grid grid;
  double crease;                 ///< x of the crease [px]
  int left_cols = 0;             ///< columns [0, left_cols) show the left plane
  std::vector<double> distance;  ///< of each column's centre from the crease [px]

  int right_cols() const { return grid.cols - left_cols; }
};

/// Both planes are inclined by 45° to the rig, so the light of one projector pixel covers √2 px².
inline constexpr double kForeshortening = 1 / std::numbers::sqrt2;

/// Point form factor between two points on different planes, at distances s and t from the crease and dy
/// apart along it: F = cos θ cos θ' dA / (π r²) = c s t / (2s² + 2t² + dy²)², c = 2√2/π, with cos θ = √2 t /
/// r, cos θ' = √2 s / r and dA = √2 px². Pixel centres on the two planes are at least one pixel apart (r ≥
/// 1), so F ≤ 0.23 without clamping. units: share of the light that leaves the first point.
double point_form_factor(double s, double t, double dy);
inline constexpr double kFormFactorScale = 2 * std::numbers::sqrt2 / std::numbers::pi;

}  // namespace symrig::sim
