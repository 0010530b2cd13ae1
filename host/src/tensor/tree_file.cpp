// SPDX-License-Identifier: Apache-2.0
#include "tensor/file_values.hpp"
#include "tensor/scene_file.hpp"

#include <algorithm>
#include <array>
#include <span>
#include <utility>
#include <vector>

namespace symrig::tensor {
namespace {

Error damaged(const std::string& name, const std::string& why) {
  return tensor::damaged("'" + name + "' " + why);
}

/// How the grid was cut. Without an attribute in the file: 1x1 views and flat.
Result<Split> read_split(const h5::Object& file, const std::string& side) {
  const std::string name = side + "_split";
  SYMRIG_TRY(const auto is_there, file.attribute(name));
  if (!is_there) return Split{};
  SYMRIG_TRY(const std::string text, h5::read_text(file, name));
  SYMRIG_TRY(const std::vector<std::int32_t> views, h5::read_integers(file, side + "_views", 2));
  const auto order = parse_split_order(text);
  if (!order) return damaged(name, "is not a split order that this program knows");
  return Split{{views[0], views[1]}, *order, {}};
}

Result<BlockTree> read_flat(const std::string& side, Grid grid, const Split& split,
                            std::span<const std::int32_t> order) {
  auto tree = BlockTree::make(grid, split);
  if (!tree) return damaged(side + "_views", "does not tile its grid");
  if (!std::ranges::equal(order, tree->order()))
    return damaged(side + "_order", "is not the block tree's order");
  return tree;
}

}  // namespace

bool write_tree(hid_t file, const std::string& side, const BlockTree& tree) {
  if (!h5::write_dataset<std::int32_t>(file, (side + "_order").c_str(), {tree.order().size()}, tree.order()))
    return false;
  if (tree.views().single() && tree.split() == SplitOrder::flat) return true;
  const std::array<std::int32_t, 2> views{tree.views().rows, tree.views().cols};
  const std::vector<std::int8_t> boundaries = tree.boundaries();
  return h5::write_attribute(file, (side + "_views").c_str(), views) &&
         h5::write_attribute(file, (side + "_split").c_str(), std::string(name(tree.split()))) &&
         (tree.split() == SplitOrder::flat ||
          h5::write_dataset<std::int8_t>(file, (side + "_boundaries").c_str(), {boundaries.size()},
                                         boundaries));
}

Result<BlockTree> read_tree(const h5::Object& file, const std::string& side, Grid grid) {
  h5::Shape shape;
  const std::string name = side + "_order";
  SYMRIG_TRY(std::vector<std::int32_t> order, h5::read_dataset<std::int32_t>(file, name, 1, shape));
  if (std::ssize(order) != grid.size()) return damaged(name, "does not fit its grid");
  SYMRIG_TRY(const Split split, read_split(file, side));
  if (split.order == SplitOrder::flat) return read_flat(side, grid, split, order);
  const std::string at = side + "_boundaries";
  SYMRIG_TRY(const std::vector<std::int8_t> boundaries, h5::read_dataset<std::int8_t>(file, at, 1, shape));
  auto tree = BlockTree::from(grid, split.views, split.order, std::move(order), boundaries);
  if (!tree)
    return damaged(at, "and '" + name + "' do not describe a block tree (" + tree.error().what + ")");
  return tree;
}

}  // namespace symrig::tensor
