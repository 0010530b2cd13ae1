// SPDX-License-Identifier: Apache-2.0
#include "symrig/tensor/file.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <gtest/gtest.h>
#include <unistd.h>

namespace symrig::tree_file_test {
namespace {

namespace fs = std::filesystem;

class TreeFile : public testing::TestWithParam<SplitOrder> {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path path() const { return folder_ / "scene.h5"; }

 private:
  fs::path folder_ = fs::path(testing::TempDir()) / ("symrig_tree_file_" + std::to_string(::getpid()));
};
INSTANTIATE_TEST_SUITE_P(Orders, TreeFile,
                         testing::Values(SplitOrder::flat, SplitOrder::views_first, SplitOrder::views_last,
                                         SplitOrder::all_at_once, SplitOrder::compensated),
                         [](const auto& order) {
                           return "order" + std::to_string(static_cast<int>(order.param));
                         });

constexpr Grid kGrid{13, 16};

/// Places that are neither whole pixels nor in any order, so that the tree cannot be guessed from the grid.
Image<float> any_surface() {
  Image<float> surface(kGrid, 2);
  for (std::size_t k = 0; k < surface.values().size(); ++k)
    surface.values()[k] = static_cast<float>(k * k % 97) / 7.0F;
  return surface;
}

StoredScene scene_of(SplitOrder order) {
  const Split split{{3, 2}, order, order == SplitOrder::compensated ? any_surface() : Image<float>()};
  auto tree = BlockTree::make(kGrid, split);
  EXPECT_TRUE(tree.ok());
  const Block& block = tree->level(2)[1];
  TensorBuilder builder(*tree, 1);
  std::vector<float> factors(2 * static_cast<std::size_t>(block.size()), 0.25F);
  builder.add_leaf(block.begin, block.end, block.begin, block.end, 1, 2, factors);
  builder.add_empty(tree->levels() - 1, 5, 3);
  builder.add_scalar(7, 7, std::vector<float>{0.5F});
  return {std::move(builder).finish(), "{}", {}};
}

void expect_same_tree(const BlockTree& a, const BlockTree& b) {
  EXPECT_EQ(a.views(), b.views());
  EXPECT_EQ(a.split(), b.split());
  EXPECT_TRUE(std::ranges::equal(a.order(), b.order()));
  EXPECT_EQ(a.boundaries(), b.boundaries());
}

TEST_P(TreeFile, comes_back_as_it_was) {
  const StoredScene scene = scene_of(GetParam());
  ASSERT_TRUE(save_scene(path(), scene).ok());
  const auto read = load_scene(path());
  ASSERT_TRUE(read.ok()) << read.error().line();
  expect_same_tree(read->tensor.camera_tree(), scene.tensor.camera_tree());
  Image<float> light(kGrid);
  for (std::size_t k = 0; k < light.values().size(); ++k) light.values()[k] = static_cast<float>(k % 5) - 1;
  EXPECT_EQ(*read->tensor.apply(light), *scene.tensor.apply(light));
}

TEST_P(TreeFile, a_flipped_bit_never_becomes_another_tree) {
  const StoredScene scene = scene_of(GetParam());
  ASSERT_TRUE(save_scene(path(), scene).ok());
  std::ifstream in(path(), std::ios::binary);
  const std::string whole{std::istreambuf_iterator<char>(in), {}};
  int refused = 0;
  for (std::size_t at = 3; at < whole.size(); at += 41) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << (at % 8)));
    std::ofstream(path(), std::ios::binary) << bytes;
    const auto read = load_scene(path());
    refused += read.ok() ? 0 : 1;
    if (read.ok()) expect_same_tree(read->tensor.camera_tree(), scene.tensor.camera_tree());
  }
  EXPECT_GT(refused, 20);
}

}  // namespace
}  // namespace symrig::tree_file_test
