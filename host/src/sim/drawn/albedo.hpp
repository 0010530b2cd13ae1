// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/grid.hpp"

#include <array>
#include <cstdint>
#include <string_view>

namespace symrig::sim::drawn {

/// How the albedo of a surface varies.
enum class Spectrum : std::uint8_t {
  white,    ///< not at all
  coarse,   ///< bumps of a third to an eighth of the picture
  fractal,  ///< amplitude 1/f: all octaves down to two points have equal power
  patches,  ///< patches of one albedo each, with sharp edges
  grain,    ///< each point by itself: a flat spectrum
};
inline constexpr int kSpectra = 5;
inline constexpr std::array<std::string_view, kSpectra> kSpectrumNames{"white", "coarse", "1/f", "patches",
                                                                       "grain"};

/// A picture of numbers from 0 to 1 with a given spectrum.
struct Texture {
  Spectrum spectrum = Spectrum::white;
  std::uint64_t key = 0;
  double cells = 6;  ///< bumps or patches along the longer side

  /// The number of a point of the grid.
  float at(Grid grid, int row, int col) const;
};

}  // namespace symrig::sim::drawn
