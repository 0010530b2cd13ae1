// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/tensor/transport_tensor.hpp"

#include <cstdint>

namespace symrig {

/// What a capture takes the unknown light inside a block for when it stops.
enum class WithinBlocks : std::uint8_t {
  direct,   ///< all of it stays on its pixel
  product,  ///< it spreads over the block, as between two blocks
};

/// What a capture would hold that stopped as soon as blocks of `level` were measured, as far as its finished
/// tensor tells: pairs that it cut further become products of what the two blocks see of each other, and a
/// block with itself becomes `within`. Level 0: the flood-lit photograph alone. Leaves that were merged of
/// several in the end count as cut further. Needs symmetric().
TransportTensor stopped_capture(const TransportTensor& tensor, int level, WithinBlocks within);

}  // namespace symrig
