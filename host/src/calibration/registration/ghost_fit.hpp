// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/outline.hpp"
#include "symrig/image/radiance.hpp"

#include <span>

namespace symrig::calibration {

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
