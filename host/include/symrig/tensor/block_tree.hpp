// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/image/image.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace symrig {

/// The order in which a block tree over several views is cut.
enum class SplitOrder : std::uint8_t {
  flat,         ///< the whole picture, without regard to views [Garg06 §5.1]
  views_first,  ///< down to single views, then each view like a separate picture
  views_last,   ///< all views in the same way down to one pixel of the tile, then the views
  all_at_once,  ///< rows with rows of views, then columns with columns of views: two levels are one level of
                ///< the 8th-order tensor, whose blocks have 16 children [Garg06 §5.1]
  compensated,  ///< like views_last, but by the point on the surface that a pixel sees instead of its place
                ///< in the tile: pixels of all views that see one point share a block at every size
};
/// "flat", "views-first", "views-last", "all-at-once", "compensated".
std::string_view name(SplitOrder order);
/// All orders, for help and completion.
std::vector<std::string_view> split_order_names();
/// fails: unknown_name.
Result<SplitOrder> parse_split_order(std::string_view text);

/// How a grid of pixels is cut into blocks.
struct Split {
  ViewLayout views;
  SplitOrder order = SplitOrder::flat;
  /// For compensated: the point that each pixel of the grid sees, as row (channel 0) and column (channel 1),
  /// in coordinates that all views share. units: pixels of a view, pixel centres at + ½. Empty for other
  /// orders.
  Image<float> surface;
};

/// A block: a range [begin, end) of tree order at one level of the tree.
struct Block {
  /// The smallest rectangle of pixels around the block. In a flat tree it is the block itself. In other trees
  /// (Split) the block's pixels may be scattered over several views in it.
  int row = 0, col = 0, rows = 0, cols = 0;
  std::int32_t begin = 0, end = 0;
  std::int32_t first_child = 0;  ///< index of the first child in the next level
  int children = 0;              ///< 1..4; the only child of a single pixel is itself; 0 at the last level

  std::int32_t size() const { return end - begin; }
  bool single_pixel() const { return size() == 1; }
};

/// The quadtree over a grid of any size (no power of two needed). Every block splits its rows and its columns
/// at the middle (larger half first) until it is one pixel. Pixels are numbered in *tree order*, so each
/// block is one contiguous range. Tensors permute a picture once and then work on ranges. [Garg06 §5.1]
/// splits uniformly; we split at the middle to allow sizes that are not powers of two. Grids of several views
/// may be cut in other orders (SplitOrder): then blocks are sets of pixels, not rectangles. Copies share
/// their blocks, which never change.
class BlockTree {
 public:
  /// The largest number of children of a block.
  static constexpr int kMaxChildren = 4;

  BlockTree();
  /// The flat tree of one picture.
  explicit BlockTree(Grid grid);
  /// A tree with any order. fails: bad_argument (views that do not fit the grid), size_mismatch or bad_value
  /// (a surface that is not [grid] with 2 channels of finite numbers within ±2²⁴).
  static Result<BlockTree> make(Grid grid, const Split& split);
  /// A tree from its description, see order() and boundaries(). fails: bad_value (it does not describe a
  /// tree).
  static Result<BlockTree> from(Grid grid, ViewLayout views, SplitOrder split,
                                std::vector<std::int32_t> order, std::span<const std::int8_t> boundaries);

  Grid grid() const { return grid_; }
  ViewLayout views() const { return views_; }
  SplitOrder split() const { return split_; }
  /// Levels 0 (one block, the whole grid) .. levels()-1 (single pixels).
  int levels() const { return static_cast<int>(nodes_->levels.size()); }
  std::span<const Block> level(int l) const { return nodes_->levels[l]; }

  /// The block of a level that contains a pixel (tree order).
  std::int32_t block_at(int l, std::int32_t pixel) const;

  /// The first level at which a pixel (tree order) is a whole block.
  int pixel_level(std::int32_t pixel) const { return nodes_->pixel_level[pixel]; }

  /// order()[tree index] = raster index, size grid().size().
  std::span<const std::int32_t> order() const { return nodes_->order; }
  /// boundaries()[t] = the first level at which tree pixels t − 1 and t lie in different blocks, 0 at t = 0.
  /// order() and boundaries() describe the tree completely. size grid().size().
  std::vector<std::int8_t> boundaries() const;

  /// Raster → tree order and back. in and out: grid().size() values each, not overlapping.
  void to_tree(std::span<const float> raster, std::span<float> tree) const;
  void to_raster(std::span<const float> tree, std::span<float> raster) const;

 private:
  struct Nodes {
    std::vector<std::vector<Block>> levels;
    std::vector<std::int32_t> order;
    std::vector<std::int8_t> pixel_level;

    void note_pixel_levels();
    Result<void> grow(Grid grid, std::span<const std::int8_t> boundaries);
    Block block_around(Grid grid, std::int32_t begin, std::int32_t end) const;
  };

  Grid grid_;
  ViewLayout views_;
  SplitOrder split_ = SplitOrder::flat;
  std::shared_ptr<const Nodes> nodes_;
};

}  // namespace symrig
