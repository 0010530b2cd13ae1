// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/tensor/transport_tensor.hpp"

#include <cstdint>
#include <vector>

namespace symrig {

/// The nodes of one level: leaves by kind, and nodes that were split into children.
struct NodeCounts {
  LeafCounts leaves;
  std::int64_t subdivided = 0;

  std::int64_t total() const {
    return leaves.rank1 + leaves.low_rank + leaves.empty + leaves.scalar + subdivided;
  }
};

/// One entry for each level of the deeper tree. It counts stored nodes: in a symmetric tensor each unordered
/// pair of blocks once. A node is subdivided if it contains a leaf of a deeper level. This is counted for
/// symmetric tensors only, because others do not grow level by level.
/// source: [Garg06 Fig. 9]
std::vector<NodeCounts> node_counts(const TransportTensor& tensor);

}  // namespace symrig
