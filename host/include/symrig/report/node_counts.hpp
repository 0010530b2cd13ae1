// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/tensor/transport_tensor.hpp"

#include <cstdint>
#include <vector>

namespace symrig {

/// What became of the nodes of one level: leaves by kind, and nodes that were split into children.
struct NodeCounts {
  LeafCounts leaves;
  std::int64_t subdivided = 0;

  std::int64_t total() const {
    return leaves.rank1 + leaves.low_rank + leaves.empty + leaves.scalar + subdivided;
  }
};

/// One entry a level of the deeper tree. Counts stored nodes: in a symmetric tensor each unordered pair of
/// blocks once. A node is subdivided if a
/// leaf of a deeper level lies in it; told for symmetric tensors only, others are not grown level by level.
/// source: [Garg06 Fig. 9]
std::vector<NodeCounts> node_counts(const TransportTensor& tensor);

}  // namespace symrig
