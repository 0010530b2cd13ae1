// SPDX-License-Identifier: Apache-2.0
// The rules of docs/file-format.md for leaves.
#pragma once

#include "tensor/read_tensor.hpp"

#include <algorithm>
#include <cstdint>
#include <span>

namespace symrig::tensor {

struct Trees {
  const BlockTree* camera;
  const BlockTree* projector;

  int levels() const { return std::max(camera->levels(), projector->levels()); }
  /// The number of blocks of a level; 0 after the tree's last level.
  static std::int64_t blocks(const BlockTree& tree, int level) {
    return level < tree.levels() ? std::ssize(tree.level(level)) : 0;
  }
};

bool range_ok(std::int32_t begin, std::int32_t end, std::int64_t size);
/// The largest magnitude of finite values; 0 if there are none.
float largest_of(std::span<const float> values);

/// True if the leaf's ranges, rank and level fit the grids, the trees and, if symmetric, its mirror image.
bool leaf_in_place(const Leaf& leaf, const Head& head, const Trees& trees);

/// True if the leaf's factors (all channels, scaled) give only entries below kLargest. On the diagonal of a
/// symmetric file they must also give a symmetric block.
bool leaf_values_ok(std::span<const float> factors, const Leaf& leaf, const Head& head);

}  // namespace symrig::tensor
