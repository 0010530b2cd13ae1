// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/node_counts.hpp"

#include <algorithm>
#include <utility>

namespace symrig {
namespace {

/// A node, identified by the beginnings of its two blocks in tree order.
using Node = std::pair<std::int32_t, std::int32_t>;

/// The beginning of the block that contains `pixel`.
std::int32_t block_begin(const BlockTree& tree, int level, std::int32_t pixel) {
  const auto blocks = tree.level(level);
  const auto after = std::upper_bound(blocks.begin(), blocks.end(), pixel,
                                      [](std::int32_t p, const Block& block) { return p < block.begin; });
  return std::prev(after)->begin;
}

/// A leaf may be stored in either half of a symmetric tensor. This gives both the same order.
Node ordered(std::int32_t row, std::int32_t col) {
  return {std::max(row, col), std::min(row, col)};
}

/// The leaves of each level as nodes.
std::vector<std::vector<Node>> leaf_nodes(const TransportTensor& tensor) {
  std::vector<std::vector<Node>> nodes(tensor.levels());
  for (const Leaf& leaf : tensor.leaves())
    nodes[leaf.level].push_back(ordered(leaf.row_begin, leaf.col_begin));
  for (const ScalarLeaf& scalar : tensor.scalars())
    nodes[tensor.scalar_level(scalar)].push_back(ordered(scalar.row, scalar.col));
  for (int level = 0; level < tensor.levels(); ++level) {
    const auto blocks = tensor.camera_tree().level(level);
    for (const EmptyLeaf& empty : tensor.empties(level))
      nodes[level].push_back(ordered(blocks[empty.row_block].begin, blocks[empty.col_block].begin));
  }
  return nodes;
}

/// The nodes of `level` that contain these deeper ones, each once.
std::vector<Node> parents_of(const std::vector<Node>& deeper, const BlockTree& tree, int level) {
  std::vector<Node> parents;
  parents.reserve(deeper.size());
  for (const auto& [row, col] : deeper)
    parents.push_back(ordered(block_begin(tree, level, row), block_begin(tree, level, col)));
  std::sort(parents.begin(), parents.end());
  parents.erase(std::unique(parents.begin(), parents.end()), parents.end());
  return parents;
}

}  // namespace

std::vector<NodeCounts> node_counts(const TransportTensor& tensor) {
  const std::vector<LeafCounts> leaves = tensor.leaves_per_level();
  std::vector<NodeCounts> counts(leaves.size());
  for (std::size_t l = 0; l < leaves.size(); ++l) counts[l].leaves = leaves[l];
  if (!tensor.symmetric()) return counts;
  const std::vector<std::vector<Node>> nodes = leaf_nodes(tensor);
  std::vector<Node> deeper;  // every node of the level below, leaf or subdivided
  for (std::size_t l = nodes.size(); l-- > 0;) {
    deeper = parents_of(deeper, tensor.camera_tree(), static_cast<int>(l));
    counts[l].subdivided = static_cast<std::int64_t>(deeper.size());
    deeper.insert(deeper.end(), nodes[l].begin(), nodes[l].end());
  }
  return counts;
}

}  // namespace symrig
