// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/light_model.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <span>

namespace symrig::calibration {

/// T of fitted pixels: direct light as one sparse column a projector pixel, near light as one a block of each
/// of the surroundings, far light as one rank-1 leaf over everything. Footprint weights below `cutoff` of the
/// largest are dropped and the rest made to sum to 1.
TransportTensor light_tensor(const PixelMap& map, std::span<const PixelLight> light,
                             std::span<const Surroundings> surroundings, BlockTree projector, double sigma,
                             double cutoff);

}  // namespace symrig::calibration
