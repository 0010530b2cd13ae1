// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/internal/json_reader.hpp"
#include "symrig/base/memory.hpp"
#include "symrig/tensor/file.hpp"
#include "tensor/h5_file.hpp"
#include "tensor/leaf_file.hpp"
#include "tensor/scene_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::tensor {

Error damaged(const std::string& what) {
  return {ErrorCode::bad_format, what, ""};
}

Error impossible(const std::string& what) {
  return {ErrorCode::bad_value, what, "the file is damaged"};
}

bool all_finite(std::span<const float> values) {
  return std::ranges::all_of(values, [](float v) { return std::isfinite(v); });
}

Result<void> check_values(std::span<const float> values, const std::string& what, float most) {
  if (!all_finite(values)) return impossible(what + " has a value that is not a finite number");
  if (largest_of(values) >= most)
    return impossible(fmt::format("{} has a value that is too large (2^{} or more)", what, std::ilogb(most)));
  return {};
}

namespace {

Error damaged_part(const std::string& name, const std::string& why) {
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
  if (!order) return damaged_part(name, "is not a split order that this program knows");
  return Split{{views[0], views[1]}, *order, {}};
}

Result<BlockTree> read_flat(const std::string& side, Grid grid, const Split& split,
                            std::span<const std::int32_t> order) {
  auto tree = BlockTree::make(grid, split);
  if (!tree) return damaged_part(side + "_views", "does not tile its grid");
  if (!std::ranges::equal(order, tree->order()))
    return damaged_part(side + "_order", "is not the block tree's order");
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
  if (std::ssize(order) != grid.size()) return damaged_part(name, "does not fit its grid");
  SYMRIG_TRY(const Split split, read_split(file, side));
  if (split.order == SplitOrder::flat) return read_flat(side, grid, split, order);
  const std::string at = side + "_boundaries";
  SYMRIG_TRY(const std::vector<std::int8_t> boundaries, h5::read_dataset<std::int8_t>(file, at, 1, shape));
  auto tree = BlockTree::from(grid, split.views, split.order, std::move(order), boundaries);
  if (!tree)
    return damaged_part(at, "and '" + name + "' do not describe a block tree (" + tree.error().what + ")");
  return tree;
}

}  // namespace symrig::tensor

namespace symrig {
namespace {

namespace fs = std::filesystem;
namespace h5 = tensor::h5;
using h5::Object;
using tensor::Head;

constexpr h5::FileWords kScene{.content = "a scene",
                               .name_one = "name a scene.h5",
                               .make_one = "`symrig capture` makes scene files",
                               .make_again = "capture or fit the scene again"};

Result<Head> read_head(const Object& file) {
  SYMRIG_TRY(const std::string format, h5::read_text(file, "format"));
  if (format != "symrig-scene")
    return Error{ErrorCode::bad_format, "attribute 'format' is not 'symrig-scene'", "is this a scene.h5?"};
  SYMRIG_TRY(const std::vector<std::int32_t> major, h5::read_integers(file, "version_major", 1));
  if (major[0] < 1 || major[0] > tensor::kVersionMajor)
    return Error{ErrorCode::bad_format,
                 "file version " + std::to_string(major[0]) + ", this program reads versions 1 and 2",
                 "use the symrig release that wrote it"};
  SYMRIG_TRY(const std::vector<std::int32_t> minor, h5::read_integers(file, "version_minor", 1));
  SYMRIG_TRY(const std::vector<std::int32_t> symmetric, h5::read_integers(file, "symmetric", 1));
  SYMRIG_TRY(const std::vector<std::int32_t> channels, h5::read_integers(file, "channels", 1));
  SYMRIG_TRY(const Grid camera, h5::read_grid(file, "camera_grid"));
  SYMRIG_TRY(const Grid projector, h5::read_grid(file, "projector_grid"));
  if (channels[0] < 1 || channels[0] > 64) return tensor::damaged("attribute 'channels' is not in 1..64");
  if (symmetric[0] != 0 && symmetric[0] != 1)
    return tensor::damaged("attribute 'symmetric' is neither 0 nor 1");
  if (symmetric[0] == 1 && !(camera == projector))
    return tensor::damaged("a symmetric tensor with two different grids");
  return Head{major[0], symmetric[0] == 1, channels[0], camera, projector, major[0] == 2 && minor[0] >= 1};
}

Result<HeldOut> read_held_out(const Object& file, const Head& head, const std::string& path) {
  SYMRIG_TRY(const Object group, h5::open_group(file, path));
  h5::Shape p, c;
  SYMRIG_TRY(std::string name, h5::read_text(group, "name"));
  SYMRIG_TRY(const auto pattern, h5::read_dataset<float>(group, "pattern", 2, p));
  SYMRIG_TRY(const auto photograph, h5::read_dataset<float>(group, "photograph", 3, c));
  if (p != h5::Shape{std::uint64_t(head.projector.rows), std::uint64_t(head.projector.cols)} ||
      c != h5::Shape{std::uint64_t(head.channels), std::uint64_t(head.camera.rows),
                     std::uint64_t(head.camera.cols)})
    return tensor::damaged("'" + path + "' does not fit the grids");
  SYMRIG_CHECK(tensor::check_values(pattern, "'" + path + "/pattern'", tensor::kBrightest));
  SYMRIG_CHECK(tensor::check_values(photograph, "'" + path + "/photograph'", tensor::kLargest));
  HeldOut held{std::move(name), Image<float>(head.projector), Image<float>(head.camera, head.channels)};
  std::copy(pattern.begin(), pattern.end(), held.pattern.values().begin());
  std::copy(photograph.begin(), photograph.end(), held.photograph.values().begin());
  return held;
}

Result<StoredScene> read_all(const Object& file, const tensor::KeepLeaves& keep, bool with_camera) {
  SYMRIG_TRY(const Head head, read_head(file));
  SYMRIG_TRY(std::string capture, h5::read_text(file, "capture"));
  if (const auto shallow = check_json_nesting(capture); !shallow)
    return Error{ErrorCode::bad_format, "attribute 'capture': " + shallow.error().what,
                 "the file is damaged"};
  SYMRIG_TRY(const BlockTree camera, tensor::read_tree(file, "camera", head.camera));
  SYMRIG_TRY(const BlockTree projector, tensor::read_tree(file, "projector", head.projector));
  TensorBuilder builder =
      head.symmetric ? TensorBuilder(camera, head.channels) : TensorBuilder(camera, projector, head.channels);
  SYMRIG_CHECK(tensor::read_tensor(file, head, camera, projector, keep, builder));
  SYMRIG_TRY(const std::int32_t held_out_count, tensor::read_count(file, "held_out_count", "held_out"));
  std::vector<HeldOut> held_out;
  for (std::int32_t k = 0; k < held_out_count; ++k) {
    SYMRIG_TRY(HeldOut one_of, read_held_out(file, head, "held_out/" + std::to_string(k)));
    held_out.push_back(std::move(one_of));
  }
  StoredScene scene{std::move(builder).finish(), std::move(capture), std::move(held_out)};
  if (with_camera) {
    SYMRIG_TRY(scene.camera, tensor::read_camera(file, head, projector));
  } else {
    SYMRIG_TRY(scene.camera_left_out, tensor::has_camera(file, head));
  }
  return scene;
}

}  // namespace

Result<StoredScene> load_scene(const fs::path& path, const LoadOptions& options) {
  const std::int64_t memory = options.memory > 0 ? options.memory : usual_memory();
  return h5::read_file(path, kScene, [&](const Object& file) {
    return read_all(file, {memory, path}, options.camera);
  });
}

}  // namespace symrig
