// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/image.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace symrig {

/// A block: a rectangle of pixels at one level of the quadtree, and the range [begin, end) it owns in tree
/// order.
struct Block {
  int row = 0, col = 0, rows = 0, cols = 0;
  std::int32_t begin = 0, end = 0;
  std::int32_t first_child = 0;  ///< index of the first child in the next level
  int children = 0;              ///< 1..4; a single pixel has itself as only child; 0 at the last level

  std::int32_t size() const { return end - begin; }
  bool single_pixel() const { return size() == 1; }
};

/// The quadtree over a grid of any size (no power of two needed): every block splits its rows and its columns
/// at the middle (larger half first) until it is one pixel. Pixels are numbered in *tree order*, so that each
/// block is one contiguous range: tensors permute a picture once and then work on ranges. [Garg06 §5.1]
/// splits uniformly; midpoint splits are our choice for sizes that are not powers of two.
class BlockTree {
 public:
  BlockTree() = default;
  explicit BlockTree(Grid grid);

  Grid grid() const { return grid_; }
  /// Levels 0 (one block, the whole grid) .. levels()-1 (single pixels).
  int levels() const { return static_cast<int>(levels_.size()); }
  std::span<const Block> level(int l) const { return levels_[static_cast<std::size_t>(l)]; }

  /// The first level at which a pixel (tree order) is a block of its own.
  int pixel_level(std::int32_t pixel) const { return pixel_level_[static_cast<std::size_t>(pixel)]; }

  /// order()[tree index] = raster index, size grid().size().
  std::span<const std::int32_t> order() const { return order_; }

  /// Raster → tree order and back. in and out: grid().size() values each, not overlapping.
  void to_tree(std::span<const float> raster, std::span<float> tree) const;
  void to_raster(std::span<const float> tree, std::span<float> raster) const;

 private:
  Grid grid_;
  std::vector<std::vector<Block>> levels_;
  std::vector<std::int32_t> order_;
  std::vector<std::int8_t> pixel_level_;
};

}  // namespace symrig
