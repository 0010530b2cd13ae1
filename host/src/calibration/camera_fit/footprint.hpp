// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/grid.hpp"
#include "symrig/image/outline.hpp"

#include <array>
#include <cstddef>

namespace symrig::calibration {

/// The shares of a camera pixel's direct light that come from the cells around the one it looks at.
struct Footprint {
  static constexpr int radius = 2, side = 2 * radius + 1;
  std::array<double, std::size_t{side} * side>
      share{};  ///< row by row; they add up to less than 1 at the grid's border
};

/// outline: of the pixel on the cells. cell: the one in the middle. blur: rms width of the light along an
/// axis [cells]: of the optics, and of the map's error.
Footprint footprint_of(const Outline& outline, int row, int col, double blur);

}  // namespace symrig::calibration
