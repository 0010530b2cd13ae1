// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/image.hpp"

#include <cstdint>
#include <span>

namespace symrig::sim {

/// Faults of the camera's optics and sensor. The default is none.
struct CameraFaults {
  double misalign = 0;  ///< pixels: (row, col) shows the light of (row + misalign, col + misalign)
  double flare = 0;     ///< share of the light that a broad one-sided flare spreads
  double dead = 0;      ///< share of dead pixels
};

/// Shifts a plane by bilinear interpolation. Pixels from outside the grid are dark.
void shift(Grid grid, double pixels, std::span<float> plane);

/// plane ← (1 − share) plane + share · K plane. K spreads light down and to the right with an exponential
/// profile whose length is a tenth of the longer side. The projector has no such flare, so the measured T is
/// not symmetric. Light that leaves the picture is lost.
void add_flare(Grid grid, double share, std::span<float> plane);

/// 1 for each dead pixel: `share` of the pixels on average, seeded. Empty if share is 0.
Image<std::uint8_t> dead_pixels(Grid grid, double share, std::uint64_t key);

}  // namespace symrig::sim
