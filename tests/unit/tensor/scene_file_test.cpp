// SPDX-License-Identifier: Apache-2.0
#include "full_disk.hpp"
#include "symrig/tensor/file.hpp"
#include "unit/tensor/random_tensor.hpp"
#include "unit/tensor/small_camera.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>

#include <gtest/gtest.h>
#include <unistd.h>

namespace symrig::scene_file_test {
namespace {

namespace fs = std::filesystem;
using tests::RandomTensor;

class SceneFile : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("symrig-scene-file-" + std::to_string(::getpid()) + "-" +
                                           testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path path(const char* name) const { return folder_ / name; }
  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

  static StoredScene example(bool symmetric = true) {
    StoredScene scene;
    scene.tensor = RandomTensor({5, 6}, {4, 3}, symmetric, 3, 11).with_band(symmetric).make(1, 2, 20).tensor;
    scene.capture_json = R"({"scene":"sim:plane","patterns":37})";
    HeldOut held{"pair 3", Image<float>(scene.tensor.projector_grid()),
                 Image<float>(scene.tensor.camera_grid(), 3)};
    held.pattern.values()[1] = 1;
    held.photograph.values()[2] = 0.5F;
    scene.held_out.push_back(held);
    auto camera = symmetric ? test::small_camera(3, scene.tensor.projector_tree())
                            : test::small_mosaic(scene.tensor.projector_tree());
    scene.camera = std::make_shared<const CameraTransport>(*CameraTransport::make(std::move(camera)));
    return scene;
  }
  static std::string bytes_of(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static void write(const fs::path& file, const std::string& bytes) {
    std::ofstream(file, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }
  static void expect_same(const CameraTransport::Parts& a, const CameraTransport::Parts& b) {
    EXPECT_TRUE(std::ranges::equal(a.cells.order(), b.cells.order()));
    EXPECT_EQ(a.camera, b.camera);
    EXPECT_EQ(a.mosaic, b.mosaic);
    EXPECT_EQ(a.registration, b.registration);
    ASSERT_EQ(a.bases.size(), b.bases.size());
    for (std::size_t k = 0; k < a.bases.size(); ++k) {
      EXPECT_EQ(a.bases[k].end, b.bases[k].end);
      EXPECT_EQ(a.bases[k].first, b.bases[k].first);
    }
    EXPECT_EQ(a.basis_values, b.basis_values);
    ASSERT_EQ(a.groups.size(), b.groups.size());
    for (std::size_t k = 0; k < a.groups.size(); ++k) {
      EXPECT_EQ(a.groups[k].channel, b.groups[k].channel);
      EXPECT_EQ(a.groups[k].columns, b.groups[k].columns);
      EXPECT_EQ(a.groups[k].pixels, b.groups[k].pixels);
    }
    EXPECT_EQ(a.columns, b.columns);
    EXPECT_EQ(a.middles, b.middles);
    EXPECT_EQ(a.steps, b.steps);
    EXPECT_EQ(a.pixels, b.pixels);
    EXPECT_EQ(a.brightness, b.brightness);
    EXPECT_EQ(a.codes, b.codes);
  }
  static void expect_same(const StoredScene& a, const StoredScene& b) {
    EXPECT_EQ(a.capture_json, b.capture_json);
    EXPECT_EQ(a.tensor.symmetric(), b.tensor.symmetric());
    EXPECT_EQ(a.tensor.camera_grid(), b.tensor.camera_grid());
    EXPECT_EQ(a.tensor.projector_grid(), b.tensor.projector_grid());
    EXPECT_TRUE(std::ranges::equal(*a.tensor.factors(), *b.tensor.factors()));
    EXPECT_TRUE(std::ranges::equal(a.tensor.scalar_values(), b.tensor.scalar_values()));
    ASSERT_EQ(a.tensor.bands().size(), b.tensor.bands().size());
    for (std::size_t k = 0; k < a.tensor.bands().size(); ++k)
      EXPECT_EQ(a.tensor.bands()[k].values, b.tensor.bands()[k].values);
    EXPECT_TRUE(std::ranges::equal(a.tensor.column_rows(), b.tensor.column_rows()));
    EXPECT_EQ(a.tensor.leaves().size(), b.tensor.leaves().size());
    ASSERT_EQ(a.camera == nullptr, b.camera == nullptr);
    if (a.camera) expect_same(a.camera->parts(), b.camera->parts());
    ASSERT_EQ(a.held_out.size(), b.held_out.size());
    for (std::size_t k = 0; k < a.held_out.size(); ++k) {
      EXPECT_EQ(a.held_out[k].name, b.held_out[k].name);
      EXPECT_EQ(a.held_out[k].pattern, b.held_out[k].pattern);
      EXPECT_EQ(a.held_out[k].photograph, b.held_out[k].photograph);
    }
  }

 private:
  fs::path folder_;
};

TEST_F(SceneFile, round_trip_is_exact) {
  for (const bool symmetric : {true, false}) {
    const StoredScene scene = example(symmetric);
    ASSERT_TRUE(save_scene(path("scene.h5"), scene).ok());
    const auto read = load_scene(path("scene.h5"));
    ASSERT_TRUE(read.ok()) << read.error().line();
    expect_same(scene, *read);
    EXPECT_EQ(files(), 1U) << "a temporary file was left behind";
  }
}

// Photographs that the release which wrote version 1 made of this file, with all pixels lit.
TEST_F(SceneFile, version_1_is_read) {
  const auto read = load_scene(SYMRIG_TEST_DATA "/version1.h5");
  ASSERT_TRUE(read.ok()) << read.error().line();
  const auto photograph = read->tensor.apply(Image<float>(Grid{5, 6}, 1, 1.0F));
  ASSERT_TRUE(photograph.ok());
  double sum = 0;
  for (const float v : photograph->values()) sum += double{v};
  constexpr double kStored = 0x1p-10 * (1 + 0x1p-11);  // halves; all of T is positive
  EXPECT_NEAR(sum, 10.982770442962646, 10.99 * kStored);
  EXPECT_NEAR(photograph->at(0, 0), 0.48796627, 0.5 * kStored);
  EXPECT_NEAR(photograph->at(2, 3), 0.33076474, 0.5 * kStored);
  EXPECT_NEAR(photograph->at(4, 5), 0.26816437, 0.5 * kStored);
  EXPECT_EQ(read->tensor.leaves().size(), 44U);
  EXPECT_EQ(read->tensor.scalar_count(), 168);
  ASSERT_TRUE(save_scene(path("now.h5"), *read).ok());
  const auto again = load_scene(path("now.h5"));
  ASSERT_TRUE(again.ok()) << again.error().line();
  expect_same(*read, *again);
}

TEST_F(SceneFile, a_long_capture_record_survives) {
  StoredScene scene = example();
  scene.capture_json = R"({"text":")" + std::string(200'000, 'x') + R"("})";
  ASSERT_TRUE(save_scene(path("scene.h5"), scene).ok());
  const auto read = load_scene(path("scene.h5"));
  ASSERT_TRUE(read.ok()) << read.error().line();
  EXPECT_EQ(read->capture_json, scene.capture_json);
}

TEST_F(SceneFile, every_truncation_is_refused) {
  ASSERT_TRUE(save_scene(path("scene.h5"), example()).ok());
  const std::string whole = bytes_of(path("scene.h5"));
  for (std::size_t size = 0; size < whole.size(); size += 1 + whole.size() / 97) {
    write(path("cut.h5"), whole.substr(0, size));
    const auto read = load_scene(path("cut.h5"));
    ASSERT_FALSE(read.ok()) << "cut to " << size << " of " << whole.size();
    EXPECT_EQ(exit_code(read.error().code), 4);
    EXPECT_NE(read.error().what.find("cut.h5"), std::string::npos);
  }
}

TEST_F(SceneFile, a_flipped_bit_is_refused_or_harmless) {
  // Checksums cover data and metadata; unused bytes of the file may change without harm. Never a silent
  // change of the content.
  const StoredScene scene = example();
  ASSERT_TRUE(save_scene(path("scene.h5"), scene).ok());
  const std::string whole = bytes_of(path("scene.h5"));
  int refused = 0;
  for (std::size_t at = 0; at < whole.size(); at += 1 + whole.size() / 499) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << (at % 8)));
    write(path("flipped.h5"), bytes);
    const auto read = load_scene(path("flipped.h5"));
    if (read.ok()) {
      expect_same(scene, *read);
    } else {
      ++refused;
      EXPECT_EQ(exit_code(read.error().code), 4) << read.error().line();
    }
  }
  EXPECT_GT(refused, 100);
}

TEST_F(SceneFile, what_is_not_a_scene_is_named) {
  EXPECT_EQ(load_scene(path("none.h5")).error().code, ErrorCode::not_found);
  write(path("text.h5"), "not HDF5 at all");
  EXPECT_EQ(load_scene(path("text.h5")).error().code, ErrorCode::bad_format);
  EXPECT_EQ(load_scene(path("")).error().code, ErrorCode::bad_format);
}

TEST_F(SceneFile, a_camera_of_another_scene_is_not_saved) {
  StoredScene scene = example();
  scene.camera = std::make_shared<const CameraTransport>(
      *CameraTransport::make(test::small_camera(1, scene.tensor.projector_tree())));
  EXPECT_EQ(save_scene(path("scene.h5"), scene).error().code, ErrorCode::bad_argument);  // of 3 channels
  scene.camera = std::make_shared<const CameraTransport>(
      *CameraTransport::make(test::small_camera(3, BlockTree({6, 5}))));
  EXPECT_EQ(save_scene(path("scene.h5"), scene).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(files(), 0U);
}

TEST_F(SceneFile, not_finite_values_are_refused) {
  TensorBuilder builder(BlockTree(Grid{2, 2}), 1);
  builder.add_scalar(0, 0, std::vector<float>{std::nanf("")});
  ASSERT_TRUE(save_scene(path("nan.h5"), {std::move(builder).finish(), "{}", {}}).ok());
  const auto read = load_scene(path("nan.h5"));
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.error().code, ErrorCode::bad_value);
}

TEST_F(SceneFile, a_failed_write_leaves_the_old_file) {
  ASSERT_TRUE(save_scene(path("scene.h5"), example()).ok());
  const std::string before = bytes_of(path("scene.h5"));
  EXPECT_EQ(save_scene(path("no/such/folder/scene.h5"), example()).error().code, ErrorCode::not_found);
  fs::create_directory(path("taken.h5"));
  write(path("taken.h5") / "x", "a folder with content cannot be replaced");
  EXPECT_EQ(save_scene(path("taken.h5"), example()).error().code, ErrorCode::io);
  EXPECT_EQ(bytes_of(path("scene.h5")), before);
  EXPECT_EQ(files(), 2U);
}

TEST_F(SceneFile, a_disk_that_is_full_anywhere_in_the_file_leaves_the_old_one) {
  const StoredScene scene = example();
  ASSERT_TRUE(save_scene(path("scene.h5"), scene).ok());
  const std::string before = bytes_of(path("scene.h5"));
  const std::size_t step = before.size() / 97;
  ASSERT_GT(step, 0U);
  for (std::size_t room = 0; room < before.size(); room += step) {
    const auto failed = [&] {
      const test::FullDisk full(room);
      return save_scene(path("scene.h5"), scene);
    }();
    ASSERT_FALSE(failed.ok()) << room;
    EXPECT_EQ(failed.error().code, ErrorCode::io) << room;
    EXPECT_NE(failed.error().what.find("File too large"), std::string::npos) << failed.error().what;
    EXPECT_EQ(bytes_of(path("scene.h5")), before) << room;
    EXPECT_EQ(files(), 1U) << room;
  }
  ASSERT_TRUE(save_scene(path("scene.h5"), scene).ok());
  const auto again = load_scene(path("scene.h5"));
  ASSERT_TRUE(again.ok());
  expect_same(scene, *again);
}

}  // namespace

}  // namespace symrig::scene_file_test

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
