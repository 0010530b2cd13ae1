// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/node_counts.hpp"

#include <algorithm>
#include <utility>

namespace symrig {
namespace {

/// A node named by the places where its two blocks begin in tree order.
using Node = std::pair<std::int32_t, std::int32_t>;

/// Where the block that holds `pixel` begins. Trees of different depth: the last level stands for deeper
/// ones.
std::int32_t block_begin(const BlockTree& tree, int level, std::int32_t pixel) {
  const auto blocks = tree.level(std::min(level, tree.levels() - 1));
  const auto after = std::upper_bound(blocks.begin(), blocks.end(), pixel,
                                      [](std::int32_t p, const Block& block) { return p < block.begin; });
  return std::prev(after)->begin;
}

void keep_unique(std::vector<Node>& nodes) {
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
}

/// The leaves of each level as nodes. A symmetric tensor's pairs are ordered, as both halves are one.
class LeafNodes {
 public:
  explicit LeafNodes(const TransportTensor& tensor)
      : symmetric_(tensor.symmetric()),
        at_(static_cast<std::size_t>(
            std::max(tensor.camera_tree().levels(), tensor.projector_tree().levels()))) {
    for (const Leaf& leaf : tensor.leaves()) add(leaf.level, leaf.row_begin, leaf.col_begin);
    for (const ScalarLeaf& scalar : tensor.scalars())
      add(tensor.scalar_level(scalar), scalar.row, scalar.col);
    for (int l = 0; l < tensor.levels(); ++l)
      for (const EmptyLeaf& empty : tensor.empties(l))
        add(l, tensor.camera_tree().level(l)[static_cast<std::size_t>(empty.row_block)].begin,
            tensor.projector_tree().level(l)[static_cast<std::size_t>(empty.col_block)].begin);
  }

  int levels() const { return static_cast<int>(at_.size()); }
  const std::vector<Node>& at(int level) const { return at_[static_cast<std::size_t>(level)]; }
  Node ordered(Node node) const {
    return symmetric_ && node.second > node.first ? Node{node.second, node.first} : node;
  }

 private:
  void add(std::int32_t level, std::int32_t row, std::int32_t col) {
    const int last = levels() - 1;
    at_[static_cast<std::size_t>(std::clamp(level, 0, last))].push_back(ordered({row, col}));
  }

  bool symmetric_;
  std::vector<std::vector<Node>> at_;
};

}  // namespace

std::vector<NodeCounts> node_counts(const TransportTensor& tensor) {
  const std::vector<LeafCounts> leaves = tensor.leaves_per_level();
  const LeafNodes nodes(tensor);
  std::vector<NodeCounts> counts(leaves.size());
  for (std::size_t l = 0; l < leaves.size(); ++l) counts[l].leaves = leaves[l];
  std::vector<Node> deeper;  // every node of the level below, leaf or subdivided
  for (int level = nodes.levels() - 1; level >= 0; --level) {
    std::vector<Node> parents;
    parents.reserve(deeper.size());
    for (const auto& [row, col] : deeper)
      parents.push_back(nodes.ordered(
          {block_begin(tensor.camera_tree(), level, row), block_begin(tensor.projector_tree(), level, col)}));
    keep_unique(parents);
    if (static_cast<std::size_t>(level) < counts.size())
      counts[static_cast<std::size_t>(level)].subdivided = static_cast<std::int64_t>(parents.size());
    deeper = std::move(parents);
    deeper.insert(deeper.end(), nodes.at(level).begin(), nodes.at(level).end());
  }
  return counts;
}

}  // namespace symrig
