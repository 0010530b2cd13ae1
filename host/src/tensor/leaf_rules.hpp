// SPDX-License-Identifier: Apache-2.0
// What docs/file-format.md demands of a leaf.
#pragma once

#include "tensor/read_tensor.hpp"

#include <algorithm>
#include <cstdint>
#include <span>

namespace symrig::scene_file {

struct Trees {
  const BlockTree* camera;
  const BlockTree* projector;

  int levels() const { return std::max(camera->levels(), projector->levels()); }
  /// Blocks of a level; 0 beyond the tree's last.
  static std::int64_t blocks(const BlockTree& tree, int level) {
    return level < tree.levels() ? std::ssize(tree.level(level)) : 0;
  }
};

bool range_ok(std::int32_t begin, std::int32_t end, std::int64_t size);
/// Of finite values: the largest size; 0 of none.
float largest_of(std::span<const float> values);

/// Its ranges, rank and level fit the grids, the trees and, if symmetric, its mirror image.
bool leaf_in_place(const Leaf& leaf, const Head& head, const Trees& trees);

/// Its factors (all channels, scaled) make no entry of kLargest or more; on the diagonal of a symmetric file
/// they make a symmetric block.
bool leaf_values_ok(std::span<const float> factors, const Leaf& leaf, const Head& head);

}  // namespace symrig::scene_file
