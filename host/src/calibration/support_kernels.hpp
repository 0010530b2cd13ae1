// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace symrig::calibration {

inline constexpr int kSupportReach = 3;  ///< camera pixels; (2 · reach + 1)² pixels are used
inline constexpr int kSlopeApart = 3;    ///< camera pixels between the two positions of a slope

/// Neighbours of one pixel.
struct Support {
  float decoded = 0;   ///< how many have a position
  float agreeing = 0;  ///< how many of these predict the pixel's position
};

/// For each of `count` pixels of a row: how many pixels around it have a position, and how many of these
/// predict the pixel's own, with the median slopes of the window, within √farthest. The median of an even
/// number of slopes is the upper one. col, row: the positions of both axes at the first pixel, NaN where
/// there is none, in pictures whose rows are `stride` apart. kSupportReach pixels on all sides of the row
/// must be readable.
void count_support(const float* col, const float* row, std::ptrdiff_t stride, std::size_t count,
                   float farthest, Support* to);

}  // namespace symrig::calibration
