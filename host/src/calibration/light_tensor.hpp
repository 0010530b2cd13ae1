// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/light_model.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <span>

namespace symrig::calibration {

/// T of fitted pixels. Direct light is one sparse column for each projector pixel. Near light is one column
/// for each block of each of the surroundings. Far light is one rank-1 leaf over everything. Footprint
/// weights below `cutoff` of the largest are dropped; the others are scaled to the sum 1.
TransportTensor light_tensor(const PixelMap& map, std::span<const PixelLight> light,
                             std::span<const Surroundings> surroundings, BlockTree projector, double sigma,
                             double cutoff);

}  // namespace symrig::calibration
