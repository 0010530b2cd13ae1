// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/grid.hpp"

#include <cstdint>
#include <vector>

namespace symrig::sim {

/// The darkest and the brightest albedo that a texture has.
inline constexpr float kDarkest = 0.08F;
inline constexpr float kBrightest = 0.8F;

/// A seeded albedo picture: patches at three scales of the picture (a quarter, a tenth, a thirtieth of its
/// longer side) with grain of one pixel on top, so that it is neither smooth nor sparse at any level of a
/// quadtree. shapes: grid, raster order. values in [kDarkest, kBrightest]. Integer hashes and +, −, ×, / of
/// floats only: bit-equal on every machine. Different keys give unrelated pictures.
std::vector<float> texture(Grid grid, std::uint64_t key);

}  // namespace symrig::sim
