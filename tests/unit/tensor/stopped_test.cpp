// SPDX-License-Identifier: Apache-2.0
#include "symrig/tensor/transport_tensor.hpp"

#include <array>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::stopped_test {
namespace {

/// T = identity, and 1/8 between all pixels of two blocks of level 1, stored by single entries.
TransportTensor fine(const BlockTree& tree) {
  TensorBuilder builder(tree, 1);
  const std::array<float, 1> one{1}, eighth{0.125F};
  for (std::int32_t i = 0; i < tree.grid().size(); ++i) builder.add_scalar(i, i, one);
  for (std::int32_t i = tree.level(1)[1].begin; i < tree.level(1)[1].end; ++i)
    for (std::int32_t j = tree.level(1)[0].begin; j < tree.level(1)[0].end; ++j)
      builder.add_scalar(i, j, eighth);
  return std::move(builder).finish();
}

Image<float> lit(Grid grid, int row, int col) {
  Image<float> light(grid);
  light.at(row, col) = 1;
  return light;
}

// A capture takes the light inside a block for direct light: cut at level 0, a lit pixel keeps all the light
// of its row.
TEST(StoppedCapture, a_block_with_itself_becomes_direct_light) {
  const BlockTree tree({4, 4});
  const TransportTensor stopped = *stopped_capture(fine(tree), 0, WithinBlocks::direct);
  const auto seen = stopped.apply(lit({4, 4}, 0, 0));
  EXPECT_FLOAT_EQ(seen->at(0, 0), 1.5F);  // 1, and four entries of 1/8
  EXPECT_EQ(seen->at(0, 3), 0);
  const auto spread = stopped_capture(fine(tree), 0, WithinBlocks::product)->apply(lit({4, 4}, 0, 0));
  EXPECT_GT(spread->at(3, 3), 0);
}

// Two blocks that see each other evenly are their own product: nothing is lost at their level.
TEST(StoppedCapture, a_pair_becomes_the_product_of_its_sums) {
  const BlockTree tree({4, 4});
  const TransportTensor whole = fine(tree);
  const TransportTensor stopped = *stopped_capture(whole, 1, WithinBlocks::direct);
  const Image<float> light = lit({4, 4}, 1, 1);
  const auto exact = whole.apply(light), seen = stopped.apply(light);
  for (std::size_t i = 0; i < 16; ++i)
    EXPECT_NEAR(seen->values()[i], exact->values()[i], 1e-3) << i;  // 16-bit floats
}

/// Rank 2 between two whole blocks of level 1.
TransportTensor merged(const BlockTree& tree) {
  TensorBuilder builder(tree, 1);
  const Block& a = tree.level(1)[0];
  const Block& b = tree.level(1)[1];
  //                          A: two columns over b           B: two columns over a
  const std::vector<float> factors{1, 1, 0, 0, 0, 0, 1, 1, 1, 1, 0, 0, 0, 0, 1, 1};
  builder.add_leaf(b.begin, b.end, a.begin, a.end, 2, 1, factors);
  return std::move(builder).finish();
}

// A leaf of rank 2 was made in the end of leaves one level further down: a capture that stops above does not
// have it.
TEST(StoppedCapture, merged_leaves_count_as_cut_further) {
  const BlockTree tree({4, 4});
  const TransportTensor above = *stopped_capture(merged(tree), 1, WithinBlocks::direct);
  for (const Leaf& leaf : above.leaves()) EXPECT_EQ(leaf.rank, 1);
  int two = 0;
  const TransportTensor below = *stopped_capture(merged(tree), 2, WithinBlocks::direct);
  for (const Leaf& leaf : below.leaves()) two += leaf.rank == 2 ? 1 : 0;
  EXPECT_EQ(two, 1);
}

}  // namespace
}  // namespace symrig::stopped_test
