// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/grid.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::bench_vm {

/// Where the pixels of the simulated camera are in the picture that the test camera delivers. The format is
/// Y12, with the first simulated pixel at (top, left). Other pixels are dark.
struct CameraPicture {
  Grid picture;
  Grid camera;  ///< of the simulated camera: the cells, or pixels of its own
  int top = 0;
  int left = 0;
  std::uint16_t dark = 0;  ///< code of an unlit pixel

  /// fails: size_mismatch (the camera's pixels are not inside the picture).
  Result<void> check() const;
  /// codes: of the camera's pixels, raster order. Returns two bytes per pixel, little-endian.
  std::vector<std::uint8_t> bytes(std::span<const std::uint16_t> codes) const;
};

}  // namespace symrig::bench_vm
