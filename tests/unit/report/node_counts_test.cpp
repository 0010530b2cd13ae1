// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/node_counts.hpp"

#include <array>

#include <gtest/gtest.h>

namespace symrig::node_counts_test {
namespace {

constexpr std::array<float, 16> kOnes{1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};

// A 2 x 2 grid: the root splits into four pixels, ten unordered pairs. By hand: four on the diagonal as
// scalars, five off it as scalars, one empty.
TEST(NodeCounts, of_a_tensor_drawn_by_hand) {
  TensorBuilder builder(BlockTree({2, 2}), 1);
  const std::array<float, 1> one{1};
  for (int i = 0; i < 4; ++i) builder.add_scalar(i, i, one);
  builder.add_empty(1, 3, 0);
  for (const auto& [i, j] : {std::pair{1, 0}, {2, 0}, {2, 1}, {3, 1}, {3, 2}}) builder.add_scalar(i, j, one);
  const std::vector<NodeCounts> counts = node_counts(std::move(builder).finish());
  ASSERT_EQ(counts.size(), 2U);
  EXPECT_EQ(counts[0].subdivided, 1);
  EXPECT_EQ(counts[0].total(), 1);
  EXPECT_EQ(counts[1].leaves.scalar, 9);
  EXPECT_EQ(counts[1].leaves.empty, 1);
  EXPECT_EQ(counts[1].subdivided, 0);
  EXPECT_EQ(counts[1].total(), 10);
}

TEST(NodeCounts, a_tensor_of_one_leaf_is_not_subdivided) {
  TensorBuilder builder(BlockTree({2, 4}), 1);
  builder.add_leaf(0, 8, 0, 8, 1, 0, kOnes);
  const std::vector<NodeCounts> counts = node_counts(std::move(builder).finish());
  EXPECT_EQ(counts[0].leaves.rank1, 1);
  for (const NodeCounts& level : counts) EXPECT_EQ(level.subdivided, 0);
}

// The order of the two blocks of a leaf does not matter: both halves of T are the same nodes.
TEST(NodeCounts, mirror_images_are_one_node) {
  const BlockTree tree({4, 4});
  const auto blocks = tree.level(1);
  TensorBuilder builder(tree, 1);
  const std::array<float, 1> one{1};
  builder.add_scalar(blocks[0].begin, blocks[1].begin, one);
  builder.add_scalar(blocks[1].begin + 1, blocks[0].begin + 1, one);
  const std::vector<NodeCounts> counts = node_counts(std::move(builder).finish());
  ASSERT_EQ(counts.size(), 3U);
  EXPECT_EQ(counts[2].leaves.scalar, 2);
  EXPECT_EQ(counts[1].subdivided, 1);
  EXPECT_EQ(counts[0].subdivided, 1);
}

}  // namespace
}  // namespace symrig::node_counts_test
