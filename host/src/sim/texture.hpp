// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/grid.hpp"

#include <cstdint>
#include <vector>

namespace symrig::sim {

/// The darkest and the brightest albedo of a texture.
inline constexpr float kDarkest = 0.08F;
inline constexpr float kBrightest = 0.8F;

/// A seeded albedo picture: patches at three scales (a quarter, a tenth, a thirtieth of the longer side) plus
/// grain of one pixel. So it is neither smooth nor sparse at any level of a quadtree. shapes: grid, raster
/// order. values in [kDarkest, kBrightest]. Uses only integer hashes and float +, −, ×, /, so results are
/// bit-equal on all computers. Different keys give unrelated pictures.
std::vector<float> texture(Grid grid, std::uint64_t key);

}  // namespace symrig::sim
