// SPDX-License-Identifier: Apache-2.0
#include "symrig/tensor/block_tree.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <tuple>

#include <gtest/gtest.h>

namespace symrig::block_tree_test {
namespace {

/// Child k of a block of level l.
const Block& child_of(const BlockTree& tree, int l, const Block& parent, int k) {
  const std::int32_t index = parent.first_child + k;
  return tree.level(l + 1)[index];
}

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
        const Block& child = child_of(tree, l, parent, k);
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
    EXPECT_EQ(tree.order()[pixel.begin], pixel.row * GetParam().cols + pixel.col);
  }
  std::vector<std::int32_t> sorted(tree.order().begin(), tree.order().end());
  std::sort(sorted.begin(), sorted.end());
  for (std::size_t i = 0; i < sorted.size(); ++i) EXPECT_EQ(sorted[i], static_cast<std::int32_t>(i));
}

TEST_P(AnyGrid, to_tree_and_back_is_identity) {
  const BlockTree tree(GetParam());
  std::vector<float> raster(GetParam().size()), order(raster.size(), -1), back(raster.size(), -1);
  std::iota(raster.begin(), raster.end(), 0.0F);
  tree.to_tree(raster, order);
  tree.to_raster(order, back);
  EXPECT_EQ(back, raster);
}

TEST(BlockTree, block_at_finds_the_block_that_holds_a_pixel) {
  const BlockTree tree(Grid{13, 9});
  for (int l = 0; l < tree.levels(); ++l)
    for (std::int32_t pixel = 0; pixel < 13 * 9; ++pixel) {
      const Block& block = tree.level(l)[tree.block_at(l, pixel)];
      EXPECT_LE(block.begin, pixel);
      EXPECT_GT(block.end, pixel);
    }
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

// Trees over several views.

struct Views {
  Grid grid;
  ViewLayout views;
};
constexpr Views kViews[] = {{{6, 6}, {2, 2}},  {{12, 9}, {3, 3}},  {{13, 29}, {3, 3}}, {{7, 20}, {1, 4}},
                            {{31, 5}, {6, 1}}, {{10, 15}, {2, 5}}, {{2, 3}, {2, 3}},   {{5, 4}, {1, 1}}};

/// Every view sees the scene shifted by its own whole number of pixels, so places repeat exactly; rows get
/// closer together downwards, so that several pixels of a view fall into one place.
Image<float> shifted_surface(Grid grid, ViewLayout views) {
  Image<float> surface(grid, 2);
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) {
      const View view = views.view_of(grid, row, col);
      const Tile tile = views.tile(grid, view);
      const int from_top = row - tile.row;
      surface.at(row, col, 0) =
          static_cast<float>(from_top < 3 ? from_top : 2 + from_top / 3 + view.row) + 0.5F;
      surface.at(row, col, 1) = static_cast<float>(col - tile.col - 2 * view.col) + 0.5F;
    }
  return surface;
}

Split split_of(const Views& of, SplitOrder order) {
  return {of.views, order,
          order == SplitOrder::compensated ? shifted_surface(of.grid, of.views) : Image<float>()};
}

BlockTree tree_of(const Views& of, SplitOrder order) {
  auto tree = BlockTree::make(of.grid, split_of(of, order));
  EXPECT_TRUE(tree.ok()) << tree.error().line();
  return *std::move(tree);
}

View view_of(const BlockTree& tree, std::int32_t t) {
  const std::int32_t pixel = tree.order()[t];
  return tree.views().view_of(tree.grid(), pixel / tree.grid().cols, pixel % tree.grid().cols);
}

void expect_same_tree(const BlockTree& a, const BlockTree& b) {
  ASSERT_EQ(a.levels(), b.levels());
  EXPECT_TRUE(std::ranges::equal(a.order(), b.order()));
  for (int l = 0; l < a.levels(); ++l) {
    ASSERT_EQ(a.level(l).size(), b.level(l).size());
    for (std::size_t k = 0; k < a.level(l).size(); ++k) {
      const Block &p = a.level(l)[k], &q = b.level(l)[k];
      EXPECT_TRUE(p.begin == q.begin && p.end == q.end && p.children == q.children);
      EXPECT_TRUE(p.row == q.row && p.col == q.col && p.rows == q.rows && p.cols == q.cols);
      EXPECT_EQ(l + 1 < a.levels() ? p.first_child : 0, l + 1 < a.levels() ? q.first_child : 0);
    }
  }
  for (std::int32_t t = 0; t < static_cast<std::int32_t>(a.order().size()); ++t)
    EXPECT_EQ(a.pixel_level(t), b.pixel_level(t));
}

class AnyOrder : public testing::TestWithParam<SplitOrder> {};
INSTANTIATE_TEST_SUITE_P(Orders, AnyOrder,
                         testing::Values(SplitOrder::flat, SplitOrder::views_first, SplitOrder::views_last,
                                         SplitOrder::all_at_once, SplitOrder::compensated),
                         [](const auto& order) {
                           std::string text(name(order.param));
                           std::ranges::replace(text, '-', '_');
                           return text;
                         });

TEST_P(AnyOrder, blocks_are_ranges_that_two_to_four_children_tile) {
  for (const Views& of : kViews) {
    const BlockTree tree = tree_of(of, GetParam());
    EXPECT_EQ(tree.split(), GetParam());
    for (int l = 0; l + 1 < tree.levels(); ++l)
      for (const Block& parent : tree.level(l)) {
        ASSERT_LE(parent.children, BlockTree::kMaxChildren);
        ASSERT_EQ(parent.children == 1, parent.single_pixel());
        std::int32_t at = parent.begin;
        for (int k = 0; k < parent.children; ++k) {
          const Block& child = child_of(tree, l, parent, k);
          EXPECT_EQ(child.begin, at);
          at = child.end;
        }
        EXPECT_EQ(at, parent.end);
      }
    EXPECT_EQ(std::ssize(tree.level(tree.levels() - 1)), of.grid.size());
    std::vector<std::int32_t> sorted(tree.order().begin(), tree.order().end());
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t i = 0; i < sorted.size(); ++i) EXPECT_EQ(sorted[i], static_cast<std::int32_t>(i));
  }
}

TEST_P(AnyOrder, a_block_lies_in_its_rectangle_and_touches_all_four_sides) {
  for (const Views& of : kViews) {
    const BlockTree tree = tree_of(of, GetParam());
    for (int l = 0; l < tree.levels(); ++l)
      for (const Block& block : tree.level(l)) {
        int top = of.grid.rows, left = of.grid.cols, bottom = -1, right = -1;
        for (std::int32_t t = block.begin; t < block.end; ++t) {
          const std::int32_t pixel = tree.order()[t];
          top = std::min(top, pixel / of.grid.cols);
          bottom = std::max(bottom, pixel / of.grid.cols);
          left = std::min(left, pixel % of.grid.cols);
          right = std::max(right, pixel % of.grid.cols);
        }
        EXPECT_EQ(block.row, top);
        EXPECT_EQ(block.col, left);
        EXPECT_EQ(block.row + block.rows - 1, bottom);
        EXPECT_EQ(block.col + block.cols - 1, right);
      }
  }
}

TEST_P(AnyOrder, order_and_boundaries_describe_the_whole_tree) {
  for (const Views& of : kViews) {
    const BlockTree tree = tree_of(of, GetParam());
    const auto again = BlockTree::from(of.grid, of.views, GetParam(),
                                       {tree.order().begin(), tree.order().end()}, tree.boundaries());
    ASSERT_TRUE(again.ok()) << again.error().line();
    expect_same_tree(*again, tree);
    EXPECT_EQ(again->views(), of.views);
    EXPECT_EQ(again->split(), GetParam());
  }
}

TEST_P(AnyOrder, name_is_parsed_back) {
  const auto parsed = parse_split_order(name(GetParam()));
  ASSERT_TRUE(parsed.ok());
  EXPECT_EQ(*parsed, GetParam());
  EXPECT_EQ(parse_split_order("sideways").error().code, ErrorCode::unknown_name);
}

TEST(ViewsTree, flat_is_the_tree_of_one_picture) {
  for (const Views& of : kViews) expect_same_tree(tree_of(of, SplitOrder::flat), BlockTree(of.grid));
}

TEST(ViewsTree, views_first_parts_the_views_before_any_pixels) {
  for (const Views& of : kViews) {
    const BlockTree tree = tree_of(of, SplitOrder::views_first);
    for (int l = 0; l < tree.levels(); ++l)
      for (const Block& block : tree.level(l)) {
        std::set<std::pair<int, int>> views;
        for (std::int32_t t = block.begin; t < block.end; ++t)
          views.insert({view_of(tree, t).row, view_of(tree, t).col});
        std::int64_t whole = 0;
        for (const auto& [row, col] : views) whole += of.views.tile(of.grid, {row, col}).grid.size();
        EXPECT_TRUE(views.size() == 1 || block.size() == whole) << to_string(of.grid) << " level " << l;
      }
  }
}

TEST(ViewsTree, views_last_cuts_all_views_alike_down_to_a_pixel_of_the_tile) {
  const Views of{{12, 12}, {3, 3}};  // tiles of 4 × 4: one pixel of each after two cuts
  const BlockTree tree = tree_of(of, SplitOrder::views_last);
  ASSERT_EQ(tree.level(2).size(), 16U);
  for (const Block& block : tree.level(2)) {
    ASSERT_EQ(block.size(), 9);
    for (std::int32_t t = block.begin; t < block.end; ++t) {
      const std::int32_t pixel = tree.order()[t];
      EXPECT_EQ(pixel / 12 % 4, block.row % 4);
      EXPECT_EQ(pixel % 12 % 4, block.col % 4);
    }
  }
}

TEST(ViewsTree, all_at_once_cuts_places_and_views_of_both_axes_in_two_levels) {
  const Views of{{16, 32}, {4, 4}};  // tiles of 4 × 8
  const BlockTree tree = tree_of(of, SplitOrder::all_at_once);
  // First the rows: half of the rows of half of the rows of views. Then the columns.
  for (const auto& [level, blocks, view_cols, tile_cols] :
       {std::tuple{1, 4U, 4U, 8U}, std::tuple{2, 16U, 2U, 4U}}) {
    ASSERT_EQ(tree.level(level).size(), blocks);
    for (const Block& block : tree.level(level)) {
      std::set<int> rows_of_views, cols_of_views, rows, cols;
      for (std::int32_t t = block.begin; t < block.end; ++t) {
        const std::int32_t pixel = tree.order()[t];
        rows_of_views.insert(view_of(tree, t).row);
        cols_of_views.insert(view_of(tree, t).col);
        rows.insert(pixel / 32 % 4);
        cols.insert(pixel % 32 % 8);
      }
      EXPECT_EQ(rows_of_views.size(), 2U);
      EXPECT_EQ(cols_of_views.size(), view_cols);
      EXPECT_EQ(rows.size(), 2U);
      EXPECT_EQ(cols.size(), tile_cols);
    }
  }
}

/// The last level at which two tree pixels share a block.
int together(const BlockTree& tree, std::int32_t a, std::int32_t b) {
  const std::vector<std::int8_t> boundaries = tree.boundaries();
  const auto [low, high] = std::minmax(a, b);
  return *std::min_element(boundaries.begin() + low + 1, boundaries.begin() + high + 1) - 1;
}

TEST(ViewsTree, compensated_keeps_what_sees_one_place_together_longest) {
  for (const Views& of : kViews) {
    const BlockTree tree = tree_of(of, SplitOrder::compensated);
    const Image<float> surface = shifted_surface(of.grid, of.views);
    const auto place = [&](std::int32_t t) {
      const std::size_t pixel = tree.order()[t];
      return std::pair{surface.plane(0)[pixel], surface.plane(1)[pixel]};
    };
    const auto n = static_cast<std::int32_t>(of.grid.size());
    for (std::int32_t t = 0; t < n; ++t) {
      int with_same = 127, with_other = -1;
      for (std::int32_t u = 0; u < n; ++u) {
        if (u == t) continue;
        (place(u) == place(t)) ? with_same = std::min(with_same, together(tree, t, u))
                               : with_other = std::max(with_other, together(tree, t, u));
      }
      EXPECT_GE(with_same, with_other) << to_string(of.grid) << " pixel " << t;
    }
  }
}

TEST(ViewsTree, places_at_any_distance_make_a_tree) {
  const Grid grid{1, 200};
  Image<float> surface(grid, 2);
  for (int col = 0; col < grid.cols; ++col) surface.at(0, col, 1) = std::ldexp(1.0F, col % 25);  // up to 2²⁴
  const auto tree = BlockTree::make(grid, {{1, 2}, SplitOrder::compensated, surface});
  ASSERT_TRUE(tree.ok());
  EXPECT_LE(tree->levels(), 127);
  EXPECT_EQ(tree->level(tree->levels() - 1).size(), 200U);
}

TEST(ViewsTree, what_describes_no_tree_is_refused) {
  const auto refused = [](std::vector<std::int32_t> order, std::vector<std::int8_t> boundaries) {
    const auto tree = BlockTree::from({1, 5}, {}, SplitOrder::flat, std::move(order), boundaries);
    return !tree.ok() && tree.error().code == ErrorCode::bad_value;
  };
  EXPECT_FALSE(refused({4, 3, 2, 1, 0}, {0, 1, 2, 1, 1}));  // a tree
  EXPECT_TRUE(refused({4, 3, 2, 1}, {0, 1, 2, 1}));         // a pixel is missing
  EXPECT_TRUE(refused({4, 3, 2, 1, 1}, {0, 1, 2, 1, 1}));   // a pixel twice
  EXPECT_TRUE(refused({5, 3, 2, 1, 0}, {0, 1, 2, 1, 1}));   // not a pixel
  EXPECT_TRUE(refused({4, 3, 2, 1, 0}, {0, 1, 1, 1, 1}));   // five children
  EXPECT_TRUE(refused({4, 3, 2, 1, 0}, {0, 2, 3, 2, 2}));   // the root has one child
  EXPECT_TRUE(refused({4, 3, 2, 1, 0}, {0, 1, 3, 1, 1}));   // so has a block
  EXPECT_TRUE(refused({4, 3, 2, 1, 0}, {1, 1, 2, 1, 1}));   // no root
  EXPECT_TRUE(refused({4, 3, 2, 1, 0}, {0, 0, 2, 1, 1}));   // two roots
  EXPECT_TRUE(refused({4, 3, 2, 1, 0}, {0, -1, 2, 1, 1}));
  EXPECT_TRUE(refused({4, 3, 2, 1, 0}, {0, 1, 2, 1}));
}

TEST(ViewsTree, views_and_surfaces_that_do_not_fit_are_refused) {
  const auto code = [](Grid grid, const Split& split) { return BlockTree::make(grid, split).error().code; };
  EXPECT_EQ(code({4, 4}, {{5, 1}, SplitOrder::views_last, {}}), ErrorCode::bad_argument);
  EXPECT_EQ(code({4, 4}, {{0, 1}, SplitOrder::views_last, {}}), ErrorCode::bad_argument);
  EXPECT_EQ(code({4, 4}, {{2, 2}, SplitOrder::compensated, {}}), ErrorCode::size_mismatch);
  EXPECT_EQ(code({4, 4}, {{2, 2}, SplitOrder::compensated, Image<float>({4, 4}, 1)}),
            ErrorCode::size_mismatch);
  Image<float> hole({4, 4}, 2);
  for (const float place :
       {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN(), -2e7F}) {
    hole.at(1, 1, 1) = place;
    EXPECT_EQ(code({4, 4}, {{2, 2}, SplitOrder::compensated, hole}), ErrorCode::bad_value);
  }
}

}  // namespace
}  // namespace symrig::block_tree_test
