// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace symrig {

/// A pixel grid of any size: rows × columns (n_y × n_x). Pixel (row, col) has raster index row * cols + col.
struct Grid {
  int rows = 0;
  int cols = 0;

  constexpr std::int64_t size() const { return std::int64_t{rows} * cols; }
  constexpr bool operator==(const Grid&) const = default;
  constexpr bool valid() const { return rows > 0 && cols > 0 && size() <= (std::int64_t{1} << 30); }
};

/// "128x96": rows x columns, as on the command line.
inline std::string to_string(Grid grid) {
  return std::to_string(grid.rows) + "x" + std::to_string(grid.cols);
}

}  // namespace symrig
