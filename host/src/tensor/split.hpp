// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/tensor/block_tree.hpp"

#include <cstdint>
#include <vector>

namespace symrig::tensor {

/// A tree, described like BlockTree::order and BlockTree::boundaries.
struct TreeShape {
  std::vector<std::int32_t> order;
  std::vector<std::int8_t> boundaries;
};

/// Cuts the pixels of a grid of views, level by level, in any order but the flat one.  needs: views fit the
/// grid; for SplitOrder::compensated a surface on the grid, values within ±2²⁴.
TreeShape cut_views(Grid grid, const Split& split);

}  // namespace symrig::tensor
