// SPDX-License-Identifier: Apache-2.0
#include "symrig/tensor/block_tree.hpp"

#include <algorithm>
#include <numeric>

#include <gtest/gtest.h>

namespace symrig {
namespace {

class AnyGrid : public testing::TestWithParam<Grid> {};
INSTANTIATE_TEST_SUITE_P(Sizes, AnyGrid,
                         testing::Values(Grid{1, 1}, Grid{1, 7}, Grid{97, 1}, Grid{2, 3}, Grid{16, 16},
                                         Grid{13, 29}, Grid{31, 35}),
                         [](const auto& grid) {
                           return "rows" + std::to_string(grid.param.rows) + "cols" +
                                  std::to_string(grid.param.cols);
                         });

TEST_P(AnyGrid, children_tile_their_parent_in_order) {
  const BlockTree tree(GetParam());
  for (int l = 0; l + 1 < tree.levels(); ++l) {
    for (const Block& parent : tree.level(l)) {
      ASSERT_GE(parent.children, 1);
      ASSERT_LE(parent.children, 4);
      std::int32_t at = parent.begin;
      for (int k = 0; k < parent.children; ++k) {
        const Block& child = tree.level(l + 1)[static_cast<std::size_t>(parent.first_child + k)];
        EXPECT_EQ(child.begin, at);
        EXPECT_EQ(child.size(), child.rows * child.cols);
        EXPECT_GE(child.row, parent.row);
        EXPECT_LE(child.row + child.rows, parent.row + parent.rows);
        EXPECT_GE(child.col, parent.col);
        EXPECT_LE(child.col + child.cols, parent.col + parent.cols);
        at = child.end;
      }
      EXPECT_EQ(at, parent.end);
      EXPECT_EQ(parent.children == 1, parent.single_pixel());
    }
  }
}

TEST_P(AnyGrid, last_level_is_single_pixels_and_order_is_a_permutation) {
  const BlockTree tree(GetParam());
  EXPECT_EQ(std::ssize(tree.level(tree.levels() - 1)), GetParam().size());
  for (const Block& pixel : tree.level(tree.levels() - 1)) {
    EXPECT_TRUE(pixel.single_pixel());
    EXPECT_EQ(tree.order()[static_cast<std::size_t>(pixel.begin)], pixel.row * GetParam().cols + pixel.col);
  }
  std::vector<std::int32_t> sorted(tree.order().begin(), tree.order().end());
  std::sort(sorted.begin(), sorted.end());
  for (std::size_t i = 0; i < sorted.size(); ++i) EXPECT_EQ(sorted[i], static_cast<std::int32_t>(i));
}

TEST_P(AnyGrid, to_tree_and_back_is_identity) {
  const BlockTree tree(GetParam());
  std::vector<float> raster(static_cast<std::size_t>(GetParam().size())), order(raster.size(), -1),
      back(raster.size(), -1);
  std::iota(raster.begin(), raster.end(), 0.0F);
  tree.to_tree(raster, order);
  tree.to_raster(order, back);
  EXPECT_EQ(back, raster);
}

TEST(BlockTree, block_sizes_of_a_level_differ_by_at_most_one_a_side) {
  const BlockTree tree(Grid{310, 350});
  EXPECT_EQ(tree.levels(), 10);
  for (int l = 0; l < tree.levels(); ++l) {
    const auto [thin, thick] =
        std::minmax_element(tree.level(l).begin(), tree.level(l).end(),
                            [](const Block& a, const Block& b) { return a.rows < b.rows; });
    EXPECT_LE(thick->rows - thin->rows, 1) << "level " << l;
  }
}

}  // namespace
}  // namespace symrig
