// SPDX-License-Identifier: Apache-2.0
#include "symrig/tensor/block_tree.hpp"

#include "symrig/tensor/internal/kernels.hpp"
#include "tensor/split.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <string>
#include <utility>

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

Result<void> check_surface(Grid grid, const Split& split) {
  if (split.order != SplitOrder::compensated) return {};
  if (split.surface.grid() != grid || split.surface.channels() != 2)
    return Error{ErrorCode::size_mismatch,
                 "the surface map is " + to_string(split.surface.grid()) + ", the grid is " + to_string(grid),
                 "give the row and the column that each pixel of the grid sees"};
  const auto values = split.surface.values();
  constexpr float kFarthest = 0x1p24F;  // up to here, a float represents every whole pixel
  if (std::any_of(values.begin(), values.end(), [](float v) { return !(std::abs(v) <= kFarthest); }))
    return Error{ErrorCode::bad_value, "the surface map has a value that is not a position",
                 "give every pixel a finite position, in pixels of a view"};
  return {};
}

/// Twice the levels of a grid of 2³⁰ pixels that is halved at each level. A limit, because levels cost
/// memory.
constexpr int kDeepest = 60;

Error not_a_tree(const std::string& why) {
  return {ErrorCode::bad_value, "the description of a block tree is not valid: " + why,
          "the file is damaged"};
}

bool is_permutation_of_indices(std::span<const std::int32_t> order) {
  std::vector<char> seen(order.size(), 0);
  for (const std::int32_t index : order) {
    if (index < 0 || index >= std::ssize(order) || seen[index] != 0) return false;
    seen[index] = 1;
  }
  return true;
}

/// False if a block would have more than kMaxChildren children, or only one although it is more than a pixel.
bool link_children(std::vector<Block>& parents, std::span<const Block> children) {
  std::size_t child = 0;
  for (Block& parent : parents) {
    parent.first_child = static_cast<std::int32_t>(child);
    for (; child < children.size() && children[child].begin < parent.end; ++child) ++parent.children;
    if (parent.children > BlockTree::kMaxChildren || (parent.children == 1) != parent.single_pixel())
      return false;
  }
  return true;
}

}  // namespace

BlockTree::BlockTree() {
  static const auto none = std::make_shared<const Nodes>();
  nodes_ = none;
}

BlockTree::BlockTree(Grid grid) : grid_(grid) {
  assert(grid.valid());
  const auto nodes = std::make_shared<Nodes>();
  auto& levels = nodes->levels;
  levels.push_back({Block{0, 0, grid.rows, grid.cols, 0, static_cast<std::int32_t>(grid.size()), 0, 0}});
  const auto splittable = [](const Block& b) { return !b.single_pixel(); };
  while (std::any_of(levels.back().begin(), levels.back().end(), splittable)) {
    std::vector<Block> next;
    next.reserve(4 * levels.back().size());
    for (Block& parent : levels.back()) {
      parent.first_child = static_cast<std::int32_t>(next.size());
      parent.children = append_children(parent, next);
    }
    levels.push_back(std::move(next));
  }
  nodes->order.resize(grid.size());
  for (const Block& pixel : levels.back()) nodes->order[pixel.begin] = pixel.row * grid.cols + pixel.col;
  nodes->note_pixel_levels();
  nodes_ = nodes;
}

Result<BlockTree> BlockTree::make(Grid grid, const Split& split) {
  if (!grid.valid() || !split.views.fits(grid))
    return Error{ErrorCode::bad_argument,
                 "views " + to_string(split.views) + " do not tile a grid of " + to_string(grid),
                 "give the rows x columns of views in the picture"};
  SYMRIG_CHECK(check_surface(grid, split));
  if (split.order == SplitOrder::flat) {
    BlockTree tree(grid);
    tree.views_ = split.views;
    return tree;
  }
  tensor::TreeShape shape = tensor::cut_views(grid, split);
  return from(grid, split.views, split.order, std::move(shape.order), shape.boundaries);
}

Result<BlockTree> BlockTree::from(Grid grid, ViewLayout views, SplitOrder split,
                                  std::vector<std::int32_t> order, std::span<const std::int8_t> boundaries) {
  if (!grid.valid() || !views.fits(grid)) return not_a_tree("its views do not tile its grid");
  if (std::ssize(order) != grid.size() || std::ssize(boundaries) != grid.size())
    return not_a_tree("its size is not the grid's");
  if (!is_permutation_of_indices(order)) return not_a_tree("its order does not contain every pixel once");
  BlockTree tree;
  tree.grid_ = grid;
  tree.views_ = views;
  tree.split_ = split;
  const auto nodes = std::make_shared<Nodes>();
  nodes->order = std::move(order);
  SYMRIG_CHECK(nodes->grow(grid, boundaries));
  nodes->note_pixel_levels();
  tree.nodes_ = nodes;
  return tree;
}

Block BlockTree::Nodes::block_around(Grid grid, std::int32_t begin, std::int32_t end) const {
  int top = grid.rows, left = grid.cols, bottom = 0, right = 0;
  for (std::int32_t t = begin; t < end; ++t) {
    const std::int32_t pixel = order[t];
    top = std::min(top, pixel / grid.cols);
    bottom = std::max(bottom, pixel / grid.cols + 1);
    left = std::min(left, pixel % grid.cols);
    right = std::max(right, pixel % grid.cols + 1);
  }
  return {top, left, bottom - top, right - left, begin, end, 0, 0};
}

Result<void> BlockTree::Nodes::grow(Grid grid, std::span<const std::int8_t> boundaries) {
  const auto n = static_cast<std::int32_t>(order.size());
  const auto [lowest, highest] = std::minmax_element(boundaries.begin() + 1, boundaries.end());
  if (boundaries[0] != 0 || (n > 1 && *lowest < 1)) return not_a_tree("its root is not one block");
  const int last = n > 1 ? *highest : 0;
  if (last > kDeepest) return not_a_tree("it is deeper than " + std::to_string(kDeepest) + " levels");
  for (int l = 0; l <= last; ++l) {
    std::vector<Block> blocks;
    for (std::int32_t begin = 0, t = 1; t <= n; ++t) {
      if (t < n && boundaries[t] > l) continue;
      blocks.push_back(block_around(grid, begin, t));
      begin = t;
    }
    if (l > 0 && !link_children(levels.back(), blocks))
      return not_a_tree("a block of level " + std::to_string(l - 1) + " does not split into 2 to 4");
    levels.push_back(std::move(blocks));
  }
  return {};
}

void BlockTree::Nodes::note_pixel_levels() {
  pixel_level.resize(order.size());
  for (std::size_t l = levels.size(); l-- > 0;)
    for (const Block& block : levels[l])
      if (block.single_pixel()) pixel_level[block.begin] = static_cast<std::int8_t>(l);
}

std::vector<std::int8_t> BlockTree::boundaries() const {
  std::vector<std::int8_t> first(order().size(), 0);
  for (int l = levels() - 1; l > 0; --l)
    for (const Block& block : level(l))
      if (block.begin > 0) first[block.begin] = static_cast<std::int8_t>(l);
  return first;
}

std::int32_t BlockTree::block_at(int l, std::int32_t pixel) const {
  const auto blocks = level(l);
  const auto after = std::upper_bound(blocks.begin(), blocks.end(), pixel,
                                      [](std::int32_t p, const Block& b) { return p < b.begin; });
  return static_cast<std::int32_t>(after - blocks.begin()) - 1;
}

void BlockTree::to_tree(std::span<const float> raster, std::span<float> tree) const {
  assert(raster.size() == order().size() && tree.size() == order().size());
  tensor::gather(order().data(), raster.data(), tree.data(), order().size());
}

void BlockTree::to_raster(std::span<const float> tree, std::span<float> raster) const {
  assert(raster.size() == order().size() && tree.size() == order().size());
  const auto order = this->order();
  for (std::size_t i = 0; i < order.size(); ++i) raster[order[i]] = tree[i];
}

}  // namespace symrig
