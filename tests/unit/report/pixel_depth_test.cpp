// SPDX-License-Identifier: Apache-2.0
#include "report/pixel_depth.hpp"

#include <array>

#include <gtest/gtest.h>

namespace symrig::report::pixel_depth_test {
namespace {

// 2 x 2 pixels, all of them blocks of level 1: pixel 0 has a direct entry, an entry with 3 and an empty pair
// with 1.
TEST(PixelDepth, counts_every_leaf_in_a_row_of_T) {
  TensorBuilder builder(BlockTree({2, 2}), 1);
  const std::array<float, 1> one{1};
  for (std::int32_t i = 0; i < 4; ++i) builder.add_scalar(i, i, one);
  builder.add_scalar(3, 0, one);
  builder.add_empty(1, 1, 0);
  const PixelDepth depth = pixel_depth(std::move(builder).finish());
  EXPECT_EQ(depth.terms.at(0, 0), 2);
  EXPECT_EQ(depth.terms.at(1, 1), 2);
  EXPECT_EQ(depth.terms.at(0, 1), 1);
  for (const float level : depth.level.values()) EXPECT_EQ(level, 1);
}

// Two blocks of level 1 see each other through a leaf of rank 2: each pixel has half its entries there.
TEST(PixelDepth, weighs_levels_by_entries) {
  const BlockTree tree({4, 4});
  TensorBuilder builder(tree, 1);
  const Block& a = tree.level(1)[0];
  const Block& b = tree.level(1)[1];
  builder.add_leaf(b.begin, b.end, a.begin, a.end, 2, 1, std::vector<float>(16, 1.0F));
  const std::array<float, 1> one{1};
  builder.add_scalar(a.begin, a.begin, one);
  const PixelDepth depth = pixel_depth(std::move(builder).finish());
  EXPECT_EQ(depth.terms.at(0, 0), 3);
  EXPECT_EQ(depth.terms.at(0, 1), 2);
  EXPECT_FLOAT_EQ(depth.level.at(0, 0), (4 * 1 + 1 * 2) / 5.0F);
  EXPECT_EQ(depth.level.at(0, 1), 1);
  EXPECT_EQ(depth.level.at(3, 3), 0);  // nothing is stored there
}

}  // namespace
}  // namespace symrig::report::pixel_depth_test
