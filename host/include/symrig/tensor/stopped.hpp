// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/tensor/transport_tensor.hpp"

#include <cstdint>

namespace symrig {

/// Where stopped_capture() puts the unknown light inside a block.
enum class WithinBlocks : std::uint8_t {
  direct,   ///< all on the diagonal: every pixel keeps its light
  product,  ///< spread over the block as a rank-1 product, as between two blocks
};

/// Estimates from a finished tensor what a capture would hold if it had stopped after `level`. Pairs of
/// blocks that were split further become a product of the light that the two blocks see of each other. A
/// block with itself becomes `within`. Level 0 uses the flood-lit photograph alone. A leaf that was merged
/// from several counts as split further. Needs symmetric().  fails: as TransportTensor::visit_leaves.
Result<TransportTensor> stopped_capture(const TransportTensor& tensor, int level, WithinBlocks within);

}  // namespace symrig
