// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/transport.hpp"
#include "symrig/image/grid.hpp"

#include <cstdint>
#include <memory>

namespace symrig::sim {

/// Three translucent blobs on a dim opaque ground:
///   T = diag(surface) + indirect · A (Σ_g w_g G_g) A,  A = diag(albedo),  four Gaussians G_g.
/// Light enters through a surface of varying albedo (A), spreads inside, and leaves through the surface (A).
/// The blobs are bright and textured. The ground is dim and textured, and no light enters it (A = 0). The
/// widths of the Gaussians are 0.7, 2.5, 8 and 25 % of the longer side, so T is dense between all points of
/// the blobs. G_g is separable. A Gaussian wider than kFineWidth pixels uses a coarser lattice, G = W G' Wᵀ
/// with linear interpolation W. It is symmetric and non-negative in both cases. units: share of the light
/// that returns; row sums ≤ 0.25 + 0.8 indirect.
/// source: the multiple-scattering half of [Jensen01], with its diffusion kernel as a sum of Gaussians.
std::unique_ptr<Transport> gummy(Grid grid, std::uint64_t key, double indirect);

}  // namespace symrig::sim
