// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hdr/mosaic.hpp"

#include <array>
#include <cstdint>
#include <string_view>

namespace symrig {

/// The colour filters of a sensor: the first two pixels of its top row, then the first two of the second row.
/// none: the sensor has no colour filters.
enum class Mosaic : std::uint8_t { none, rggb, grbg, gbrg, bggr };

/// The mosaic of the sensor's region that begins at pixel (rows, cols).
constexpr Mosaic shifted(Mosaic mosaic, int rows, int cols) {
  if (mosaic == Mosaic::none) return mosaic;
  // In the order of the enumeration, one more column swaps 0↔1 and 2↔3. One more row swaps 0↔2 and 1↔3.
  const int index = (static_cast<int>(mosaic) - 1) ^ (cols & 1) ^ (2 * (rows & 1));
  return static_cast<Mosaic>(index + 1);
}

/// Which colour each pixel sees. mosaic: not none.
constexpr BayerPattern filters(Mosaic mosaic) {
  const int index = static_cast<int>(mosaic) - 1;  // as in shifted()
  const BayerPattern rggb;
  const auto seen = [&](int row, int col) { return rggb.at(row + index / 2, col + index % 2); };
  return {{seen(0, 0), seen(0, 1), seen(1, 0), seen(1, 1)}};
}

/// "none", "rggb", "grbg", "gbrg", "bggr".
constexpr std::string_view name(Mosaic mosaic) {
  constexpr std::array<std::string_view, 5> names{"none", "rggb", "grbg", "gbrg", "bggr"};
  return names.at(static_cast<std::size_t>(mosaic));
}

}  // namespace symrig
