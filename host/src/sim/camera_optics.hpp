// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/image.hpp"

#include <cstdint>
#include <span>

namespace symrig::sim {

/// What is wrong with the light on its way to the sensor; nothing by default.
struct CameraFaults {
  double misalign = 0;  ///< pixels: the camera sees at (row, col) what is at (row + misalign, col + misalign)
  double flare = 0;     ///< share of the light that a broad one-sided flare carries away
  double dead = 0;      ///< share of dead pixels
};

/// Shifts a plane by bilinear interpolation; what comes from outside the grid is dark.
void shift(Grid grid, double pixels, std::span<float> plane);

/// plane ← (1 − share) plane + share · K plane: K carries light down and to the right with an exponential
/// profile, a tenth of the longer side long. It has no counterpart in the projector, so that the measured T
/// is not symmetric. Light carried over the border is lost.
void add_flare(Grid grid, double share, std::span<float> plane);

/// 1 for each dead pixel: the given share on average, seeded. Empty if share is 0.
Image<std::uint8_t> dead_pixels(Grid grid, double share, std::uint64_t key);

}  // namespace symrig::sim
