// SPDX-License-Identifier: Apache-2.0
// Converts pictures to the kernels' layout: pixels in tree order, patterns interleaved lane by lane.
#pragma once

#include "tensor/kernels.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace symrig::tensor {

/// to[i] = from[order[i]], i < n.
void gather(const std::int32_t* order, const float* from, float* to, std::size_t n);

/// One row of n values for each lane.
using LaneRows = std::array<const float*, kBatch>;
using LaneRowsOut = std::array<float*, kBatch>;

/// p[i][lane] = lanes[lane][i], i < n. shapes: p [n × kBatch].
void interleave(const LaneRows& lanes, std::size_t n, float* p);

/// lanes[lane][i] = p[i][lane], i < n.
void deinterleave(const float* p, std::size_t n, const LaneRowsOut& lanes);

}  // namespace symrig::tensor
