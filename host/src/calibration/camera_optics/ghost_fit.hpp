// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/image.hpp"
#include "symrig/image/outline.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::calibration {

/// For each pattern, 1 for the cells that are not lit and have no lit neighbour: direct light reaches them
/// only as a ghost.
std::vector<Image<std::uint8_t>> dark_cells(std::span<const Pattern> patterns);

/// The best candidate for the place of a ghost.
struct GhostCandidate {
  Point place;  ///< [cells]
  /// Its share of the light less that of the place opposite, outliers clamped.
  double share = 0;
  double sigma = 0;  ///< robust standard deviation of this over all candidates
};

/// Judges all places around on the cells. photographs: of `patterns`, on the cells. The channels are added
/// up.
GhostCandidate find_ghost(std::span<const Pattern> patterns, std::span<const Radiance> photographs);

struct GhostFit {
  double share = 0, opposite = 0;  ///< of the light; of a ghost at the place opposite
  Point place;                     ///< [cells]
};

/// Fits share and place on the camera's pixels, from a place that is right to a cell.
///
/// y = share / (1 − share) · y displaced, in dark pixels and less the means over their dark photographs. A
/// robust regression on the displaced photograph and on its slopes moves the place and gives the share.
/// photographs: of `patterns`, on the camera's grid.
GhostFit fit_ghost(std::span<const Pattern> patterns, std::span<const Radiance> photographs,
                   std::span<const CornerMap> corners, Point place);

}  // namespace symrig::calibration
