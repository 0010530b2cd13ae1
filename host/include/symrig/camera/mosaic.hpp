// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace symrig {

/// The colours of a sensor's pixels: the first two of its top row, then the first two of the row below.
/// none: every pixel sees the same light.
enum class Mosaic : std::uint8_t { none, rggb, grbg, gbrg, bggr };

/// The same sensor seen from pixel (rows, cols) on: what a region that begins there has in its corner.
constexpr Mosaic shifted(Mosaic mosaic, int rows, int cols) {
  if (mosaic == Mosaic::none) return mosaic;
  // In the order of the enumeration, one column further swaps 0↔1 and 2↔3, one row further 0↔2 and 1↔3.
  const int index = (static_cast<int>(mosaic) - 1) ^ (cols & 1) ^ (2 * (rows & 1));
  return static_cast<Mosaic>(index + 1);
}

/// "none", "rggb", "grbg", "gbrg", "bggr".
constexpr std::string_view name(Mosaic mosaic) {
  constexpr std::array<std::string_view, 5> names{"none", "rggb", "grbg", "gbrg", "bggr"};
  return names.at(static_cast<std::size_t>(mosaic));
}

}  // namespace symrig
