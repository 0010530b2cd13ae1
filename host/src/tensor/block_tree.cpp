// SPDX-License-Identifier: Apache-2.0
#include "symrig/tensor/block_tree.hpp"

#include <algorithm>
#include <cassert>

namespace symrig {
namespace {

/// The larger half first: 5 → 3 + 2. A single row or column is not split.
struct Halves {
  int first, second;
};
Halves halves(int n) {
  return {(n + 1) / 2, n / 2};
}

/// Appends the 1..4 children of `parent` in reading order and returns how many there are.
int append_children(const Block& parent, std::vector<Block>& next) {
  const auto [top, bottom] = halves(parent.rows);
  const auto [left, right] = halves(parent.cols);
  int count = 0;
  std::int32_t begin = parent.begin;
  const auto append = [&](int row, int col, int rows, int cols) {
    if (rows == 0 || cols == 0) return;
    const std::int32_t end = begin + rows * cols;
    next.push_back({row, col, rows, cols, begin, end, 0, 0});
    begin = end;
    ++count;
  };
  append(parent.row, parent.col, top, left);
  append(parent.row, parent.col + left, top, right);
  append(parent.row + top, parent.col, bottom, left);
  append(parent.row + top, parent.col + left, bottom, right);
  return count;
}

}  // namespace

BlockTree::BlockTree(Grid grid) : grid_(grid) {
  assert(grid.valid());
  levels_.push_back({Block{0, 0, grid.rows, grid.cols, 0, static_cast<std::int32_t>(grid.size()), 0, 0}});
  const auto splittable = [](const Block& b) { return !b.single_pixel(); };
  while (std::any_of(levels_.back().begin(), levels_.back().end(), splittable)) {
    std::vector<Block> next;
    next.reserve(4 * levels_.back().size());
    for (Block& parent : levels_.back()) {
      parent.first_child = static_cast<std::int32_t>(next.size());
      parent.children = append_children(parent, next);
    }
    levels_.push_back(std::move(next));
  }
  order_.resize(static_cast<std::size_t>(grid.size()));
  for (const Block& pixel : levels_.back())
    order_[static_cast<std::size_t>(pixel.begin)] = pixel.row * grid.cols + pixel.col;
  pixel_level_.resize(order_.size());
  for (int l = levels() - 1; l >= 0; --l)
    for (const Block& block : level(l))
      if (block.single_pixel())
        pixel_level_[static_cast<std::size_t>(block.begin)] = static_cast<std::int8_t>(l);
}

void BlockTree::to_tree(std::span<const float> raster, std::span<float> tree) const {
  assert(raster.size() == order_.size() && tree.size() == order_.size());
  for (std::size_t i = 0; i < order_.size(); ++i) tree[i] = raster[static_cast<std::size_t>(order_[i])];
}

void BlockTree::to_raster(std::span<const float> tree, std::span<float> raster) const {
  assert(raster.size() == order_.size() && tree.size() == order_.size());
  for (std::size_t i = 0; i < order_.size(); ++i) raster[static_cast<std::size_t>(order_[i])] = tree[i];
}

}  // namespace symrig
