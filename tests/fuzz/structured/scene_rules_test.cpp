// SPDX-License-Identifier: Apache-2.0
// Each rule of docs/file-format.md about numbers: a whole file in which one number breaks it is refused.
// The rules of the file refuse nothing that a capture makes: every algorithm, noise, optics out of line,
// views.
#include "scratch.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "symrig/tensor/file.hpp"
#include "unit/tensor/random_tensor.hpp"
#include "unit/tensor/small_camera.hpp"

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <hdf5.h>

namespace symrig::structured::scene_rules_test {
namespace {

/// A scene file that is open for changes; whole again when it is closed.
class OpenScene {
 public:
  explicit OpenScene(const std::filesystem::path& path)
      : file_(H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT)) {
    EXPECT_GE(file_, 0);
  }
  OpenScene(const OpenScene&) = delete;
  OpenScene& operator=(const OpenScene&) = delete;
  ~OpenScene() { H5Fclose(file_); }

  void set(const char* attribute, std::int32_t value) const {
    const hid_t at = H5Aopen(file_, attribute, H5P_DEFAULT);
    EXPECT_GE(H5Awrite(at, H5T_NATIVE_INT32, &value), 0);
    H5Aclose(at);
  }
  void set_camera_grid(std::int32_t rows, std::int32_t cols) const {
    const hid_t group = H5Gopen2(file_, "camera", H5P_DEFAULT);
    const hid_t at = H5Aopen(group, "grid", H5P_DEFAULT);
    const std::int32_t grid[2]{rows, cols};
    EXPECT_GE(H5Awrite(at, H5T_NATIVE_INT32, grid), 0);
    H5Aclose(at);
    H5Gclose(group);
  }
  /// One element of a dataset of whole numbers or of floats.
  template <class T>
  void set(const char* dataset, std::size_t element, T value) const {
    const hid_t at = H5Dopen2(file_, dataset, H5P_DEFAULT);
    const hid_t space = H5Dget_space(at);
    const hid_t native = std::is_integral_v<T> ? H5T_NATIVE_INT32 : H5T_NATIVE_FLOAT;
    std::vector<T> values(H5Sget_simple_extent_npoints(space));
    EXPECT_GE(H5Dread(at, native, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
    values.at(element) = value;
    EXPECT_GE(H5Dwrite(at, native, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
    H5Sclose(space);
    H5Dclose(at);
  }
  /// The text again as a text of variable length, as h5py writes it.
  void set_variable(const char* attribute, const char* text, H5T_cset_t letters) const {
    H5Adelete(file_, attribute);
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, H5T_VARIABLE);
    H5Tset_cset(type, letters);
    const hid_t space = H5Screate(H5S_SCALAR);
    const hid_t at = H5Acreate2(file_, attribute, type, space, H5P_DEFAULT, H5P_DEFAULT);
    EXPECT_GE(H5Awrite(at, type, static_cast<const void*>(&text)), 0);
    H5Aclose(at);
    H5Sclose(space);
    H5Tclose(type);
  }
  void set_fixed(const char* attribute, const std::string& text, H5T_str_t pad) const {
    H5Adelete(file_, attribute);
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, text.size());
    H5Tset_strpad(type, pad);
    const hid_t space = H5Screate(H5S_SCALAR);
    const hid_t at = H5Acreate2(file_, attribute, type, space, H5P_DEFAULT, H5P_DEFAULT);
    EXPECT_GE(H5Awrite(at, type, text.data()), 0);
    H5Aclose(at);
    H5Sclose(space);
    H5Tclose(type);
  }
  void link_elsewhere(const char* name) const {
    H5Ldelete(file_, name, H5P_DEFAULT);
    EXPECT_GE(H5Lcreate_external("other.h5", "/x", file_, name, H5P_DEFAULT, H5P_DEFAULT), 0);
  }

 private:
  hid_t file_;
};

class SceneRules : public testing::Test {
 protected:
  void SetUp() override {
    // Leaf 0 is the whole picture with itself, rank 2; leaf 1 and 2 lie between its quarters.
    TensorBuilder builder(BlockTree(Grid{4, 4}), 1);
    std::vector<float> whole(64, 0.5F);
    for (std::size_t k = 0; k < 16; ++k) whole[k] = whole[32 + k] = 1.F + 0.1F * static_cast<float>(k);
    builder.add_leaf(0, 16, 0, 16, 2, 0, whole);
    builder.add_leaf(4, 8, 0, 4, 1, 1, std::vector<float>(8, 0.25F));
    builder.add_leaf(8, 12, 0, 4, 1, 1, std::vector<float>(8, 0.25F));
    for (std::int32_t i = 0; i < 16; ++i) builder.add_scalar(i, i, std::vector<float>{2});
    builder.add_scalar(5, 3, std::vector<float>{0.5F});
    builder.add_empty(1, 3, 0);
    builder.add_band(1, std::vector<float>(64, 0.125F));
    StoredScene scene;
    scene.tensor = std::move(builder).finish();
    scene.held_out.push_back({"pair", Image<float>(Grid{4, 4}, 1, 1.F), Image<float>(Grid{4, 4}, 1, 3.F)});
    scene.camera = std::make_shared<const CameraTransport>(
        *CameraTransport::make(test::small_camera(1, scene.tensor.projector_tree())));
    ASSERT_TRUE(save_scene(file_, scene).ok());
    const auto read = load_scene(file_);
    ASSERT_TRUE(read.ok()) << read.error().line();
  }

  void expect_refused(const std::string& word) const {
    const auto read = load_scene(file_);
    ASSERT_FALSE(read.ok());
    EXPECT_EQ(exit_code(read.error().code), 4);
    EXPECT_NE(read.error().what.find(word), std::string::npos) << read.error().line();
  }

  test::Scratch folder_;
  std::filesystem::path file_ = folder_ / "scene.h5";
};

// stopped_at() writes a leaf's sums into the block of a coarser level that holds its first pixel: with this
// level it wrote beyond that block.
TEST_F(SceneRules, a_leaf_larger_than_a_block_of_the_level_above_its_own) {
  OpenScene(file_).set("leaves/level", 0, std::int32_t{2});
  expect_refused("leaf 0");
}
TEST_F(SceneRules, a_level_that_is_not_there) {
  OpenScene(file_).set("leaves/level", 1, std::int32_t{3});
  expect_refused("leaf 1");
}
TEST_F(SceneRules, symmetric_is_neither_0_nor_1) {
  OpenScene(file_).set("symmetric", 7);
  expect_refused("'symmetric'");
}
TEST_F(SceneRules, a_negative_number_of_held_out_photographs) {
  OpenScene(file_).set("held_out_count", -1);
  expect_refused("'held_out_count'");
}
TEST_F(SceneRules, a_negative_number_of_bands) {
  OpenScene(file_).set("band_count", -1);
  expect_refused("'band_count'");
}
TEST_F(SceneRules, fewer_groups_counted_than_there_are) {
  OpenScene(file_).set("band_count", 0);
  expect_refused("'band_count'");
}
TEST_F(SceneRules, a_pixel_twice_on_the_diagonal) {
  OpenScene(file_).set("diagonal/at", 5, std::int32_t{4});
  expect_refused("'diagonal/at'");
}
TEST_F(SceneRules, a_leaf_that_overlaps_its_mirror_image) {
  OpenScene(file_).set("leaves/range", 4, std::int32_t{0});  // rows 0..8 against columns 0..4
  expect_refused("leaf 1");
}
TEST_F(SceneRules, a_block_of_the_diagonal_that_is_not_symmetric) {
  OpenScene(file_).set("leaves/factors", 3, 2.F);  // of A, not of B
  expect_refused("leaf 0");
}
TEST_F(SceneRules, a_product_of_factors_that_overflows) {
  OpenScene(file_).set("leaves/exponents", 4, std::int32_t{70});
  OpenScene(file_).set("leaves/exponents", 5, std::int32_t{70});
  expect_refused("leaf 1");
}
TEST_F(SceneRules, a_value_that_no_scene_has) {
  OpenScene(file_).set("diagonal/values", 2, 0x1p100F);
  expect_refused("'diagonal/values'");
}
TEST_F(SceneRules, a_held_out_photograph_that_is_not_finite) {
  OpenScene(file_).set("held_out/0/photograph", 2, std::numeric_limits<float>::infinity());
  expect_refused("'held_out/0/photograph'");
}
TEST_F(SceneRules, a_dataset_in_another_file) {
  OpenScene(file_).link_elsewhere("leaves/rank");
  expect_refused("leaves/rank");
}
TEST_F(SceneRules, a_capture_record_that_nests_too_deep) {
  const std::string deep = std::string(50'000, '[') + std::string(50'000, ']');
  OpenScene(file_).set_variable("capture", deep.c_str(), H5T_CSET_UTF8);
  expect_refused("'capture'");
}

TEST_F(SceneRules, a_basis_of_the_camera_beyond_the_cells) {
  OpenScene(file_).set("camera/bases", 1, std::int32_t{17});
  expect_refused("'camera'");
}
TEST_F(SceneRules, a_rank_of_the_camera_that_is_impossible) {
  OpenScene(file_).set("camera/bases", 2, std::int32_t{-1});
  expect_refused("'camera/bases'");
}
TEST_F(SceneRules, more_codes_of_the_camera_than_there_are) {
  OpenScene(file_).set("camera/groups", 2, std::numeric_limits<std::int32_t>::max());
  expect_refused("the number of codes");
}
TEST_F(SceneRules, a_pixel_of_the_camera_twice) {
  OpenScene(file_).set("camera/pixels", 1, std::int32_t{13});
  expect_refused("named twice");
}
TEST_F(SceneRules, a_pixel_beyond_the_camera) {
  OpenScene(file_).set("camera/pixels", 1, std::int32_t{15});
  expect_refused("the number of a pixel");
}
TEST_F(SceneRules, a_column_of_the_camera_that_is_not_there) {
  OpenScene(file_).set("camera/columns", 2, std::int32_t{-17});
  expect_refused("the number of a column");
}
TEST_F(SceneRules, a_camera_that_has_hardly_any_rows) {
  OpenScene(file_).set_camera_grid(1 << 15, 1 << 15);
  OpenScene(file_).set("camera/size", 0, std::int32_t{1 << 15});
  OpenScene(file_).set("camera/size", 1, std::int32_t{1 << 15});
  expect_refused("'camera/grid'");
}
TEST_F(SceneRules, a_size_of_the_camera_that_is_not_its_grid) {
  OpenScene(file_).set("camera/size", 1, std::int32_t{7});
  expect_refused("'camera/size'");
}
// Before 2.1 the name was free for other programs.
TEST_F(SceneRules, an_older_file_may_have_anything_of_this_name) {
  OpenScene(file_).set("camera/bases", 1, std::int32_t{17});
  OpenScene(file_).set("version_minor", 0);
  const auto read = load_scene(file_);
  ASSERT_TRUE(read.ok()) << read.error().line();
  EXPECT_EQ(read->camera, nullptr);
}
TEST_F(SceneRules, a_reader_may_leave_the_camera_out) {
  const auto read = load_scene(file_, {.camera = false});
  ASSERT_TRUE(read.ok()) << read.error().line();
  EXPECT_EQ(read->camera, nullptr);
  EXPECT_TRUE(read->camera_left_out);
  EXPECT_FALSE(load_scene(file_)->camera_left_out);
}
TEST_F(SceneRules, a_coefficient_of_the_camera_that_no_scene_has) {
  OpenScene(file_).set("camera/brightness", 2, 0x1p59F);
  expect_refused("the size of a coefficient");
}
TEST_F(SceneRules, a_brightness_that_is_not_finite) {
  OpenScene(file_).set("camera/brightness", 2, std::numeric_limits<float>::quiet_NaN());
  expect_refused("the brightness");
}

// f.attrs['format'] = 'symrig-scene' of h5py, and what other writers do.
TEST_F(SceneRules, texts_may_be_of_any_length_type_and_padding) {
  for (const H5T_cset_t letters : {H5T_CSET_ASCII, H5T_CSET_UTF8}) {
    OpenScene(file_).set_variable("format", "symrig-scene", letters);
    OpenScene(file_).set_variable("capture", R"({"scene":"sim:plane"})", letters);
    const auto read = load_scene(file_);
    ASSERT_TRUE(read.ok()) << read.error().line();
    EXPECT_EQ(read->capture_json, R"({"scene":"sim:plane"})");
  }
  OpenScene(file_).set_fixed("format", "symrig-scene   ", H5T_STR_SPACEPAD);
  OpenScene(file_).set_fixed("capture", std::string("{}\0rest", 7), H5T_STR_NULLTERM);
  const auto read = load_scene(file_);
  ASSERT_TRUE(read.ok()) << read.error().line();
  EXPECT_EQ(read->capture_json, "{}");
}

CaptureOptions options_of(Algorithm algorithm, int polish) {
  CaptureOptions options;
  options.algorithm = algorithm;
  options.rule = default_rule(algorithm);
  options.economy = default_economy(algorithm);
  options.economy->polish = polish;
  return options;
}

class CapturedScenes : public testing::TestWithParam<std::pair<const char*, Algorithm>> {};

TEST_P(CapturedScenes, are_read_again) {
  const auto& [rig, algorithm] = GetParam();
  const test::Scratch folder;
  for (const int polish : {0, 2}) {
    auto probe = open_virtual_rig(rig);
    ASSERT_TRUE(probe.ok()) << probe.error().line();
    CaptureOptions options = options_of(algorithm, polish);
    // Optics that are this far out of line are refused otherwise.
    options.unchecked = std::string_view(rig).find("misalign") != std::string_view::npos;
    auto captured = capture(**probe, options);
    ASSERT_TRUE(captured.ok()) << captured.error().line();
    ASSERT_TRUE(save_scene(folder / "scene.h5", {captured->tensor, "{}", captured->held_out, {}}).ok());
    const auto read = load_scene(folder / "scene.h5");
    EXPECT_TRUE(read.ok()) << read.error().line();
  }
}

INSTANTIATE_TEST_SUITE_P(Rigs, CapturedScenes,
                         testing::Values(std::pair{"sim:vgroove-textured?size=24x20", Algorithm::symrig},
                                         std::pair{"sim:gummy?size=20x24&noise=off", Algorithm::symrig},
                                         std::pair{"sim:gummy?size=16x16&misalign=0.7", Algorithm::symrig},
                                         std::pair{"sim:vgroove-textured?size=16x16&psf=0.2",
                                                   Algorithm::symrig},
                                         std::pair{"sim:views2?size=24x24", Algorithm::symrig},
                                         std::pair{"sim:vgroove-white?size=16x16", Algorithm::paper},
                                         std::pair{"sim:vgroove-white?size=8x8", Algorithm::brute},
                                         std::pair{"sim:vgroove-white?size=8x8", Algorithm::dual}));

}  // namespace
}  // namespace symrig::structured::scene_rules_test
