// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/grid.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::bench_vm {

/// Where the grid is in the camera's picture. The format is Y12, with one camera pixel per grid pixel and the
/// first one at (top, left). Other pixels are dark.
struct CameraPicture {
  Grid camera;
  Grid grid;
  int top = 0;
  int left = 0;
  std::uint16_t dark = 0;  ///< code of an unlit pixel

  /// fails: size_mismatch (the grid is not inside the picture).
  Result<void> check() const;
  /// codes: of the grid, raster order. Returns two bytes per pixel, little-endian.
  std::vector<std::uint8_t> bytes(std::span<const std::uint16_t> codes) const;
};

}  // namespace symrig::bench_vm
