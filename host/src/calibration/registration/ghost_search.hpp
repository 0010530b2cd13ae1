// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/outline.hpp"
#include "symrig/image/radiance.hpp"

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

}  // namespace symrig::calibration
