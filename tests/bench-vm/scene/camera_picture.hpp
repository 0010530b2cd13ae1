// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/grid.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::bench_vm {

/// How the camera's picture holds the grid: in the format Y12, one camera pixel a grid pixel, the first one
/// at (top, left). Around it the camera sees nothing.
struct CameraPicture {
  Grid camera;
  Grid grid;
  int top = 0;
  int left = 0;
  std::uint16_t dark = 0;  ///< code of an unlit pixel

  /// fails: size_mismatch (the grid is not inside).
  Result<void> check() const;
  /// codes: of the grid, raster order. Two bytes a pixel, the lower one first.
  std::vector<std::uint8_t> bytes(std::span<const std::uint16_t> codes) const;
};

}  // namespace symrig::bench_vm
