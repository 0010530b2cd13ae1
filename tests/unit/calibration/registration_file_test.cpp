// SPDX-License-Identifier: Apache-2.0
#include "scratch.hpp"
#include "small_registration.hpp"
#include "symrig/base/files.hpp"
#include "symrig/calibration/registration.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "symrig/tensor/file.hpp"

#include <cmath>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <span>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::registration_file_test {
namespace {

namespace fs = std::filesystem;
using tests::small_registration;

class RegistrationFile : public testing::Test {
 protected:
  fs::path file() const { return folder_ / "registration.h5"; }
  /// The error of reading bytes.
  Error error_of(std::span<const std::byte> bytes) const {
    EXPECT_TRUE(write_file_atomically(file(), bytes).ok());
    const auto read = load_registration(file());
    EXPECT_FALSE(read.ok());
    return read ? Error{} : read.error();
  }

  test::Scratch folder_;
};

TEST_F(RegistrationFile, keeps_every_bit) {
  const Registration written = small_registration();
  ASSERT_TRUE(save_registration(file(), written).ok());
  const auto read = load_registration(file());
  ASSERT_TRUE(read.ok()) << read.error().line();
  EXPECT_EQ(read->cells, written.cells);
  EXPECT_EQ(read->camera(), written.camera());
  EXPECT_EQ(read->rig, written.rig);
  EXPECT_EQ(read->photographs, written.photographs);
  EXPECT_TRUE(std::ranges::equal(read->flood.mean.values(), written.flood.mean.values()));
  EXPECT_TRUE(std::ranges::equal(read->flood.variance.values(), written.flood.variance.values()));
  EXPECT_TRUE(std::ranges::equal(read->flood.valid.values(), written.flood.valid.values()));
  EXPECT_TRUE(std::ranges::equal(read->shares.values(), written.shares.values()));
  EXPECT_EQ(read->gain.shape, written.gain.shape);
  EXPECT_EQ(read->gain.sigma, written.gain.sigma);
  EXPECT_EQ(read->gain.veil, written.gain.veil);
  EXPECT_EQ(read->gain.veil_sigma, written.gain.veil_sigma);
  EXPECT_EQ(read->gain.pairs, written.gain.pairs);
  EXPECT_EQ(read->gain.known, written.gain.known);
  EXPECT_EQ(read->blur.projector, written.blur.projector);
  EXPECT_EQ(read->blur.camera, written.blur.camera);
  EXPECT_EQ(read->blur.sigma, written.blur.sigma);
  EXPECT_EQ(read->blur.measured, written.blur.measured);
  EXPECT_TRUE(std::ranges::equal(read->stripes.values(), written.stripes.values()));
  ASSERT_EQ(read->maps.size(), 2U);
  for (std::size_t k = 0; k < 2; ++k) {
    const CameraMapNumbers a = written.maps[k].numbers(), b = read->maps[k].numbers();
    EXPECT_EQ(a.row, b.row);
    EXPECT_EQ(a.col, b.col);
    EXPECT_EQ(a.error, b.error);
    EXPECT_EQ(a.edge_width, b.edge_width);
    EXPECT_EQ(a.outlier_share, b.outlier_share);
    EXPECT_EQ(a.edges, b.edges);
    const Point look = read->maps[k].look({7.5, 9});
    EXPECT_EQ(look.row, written.maps[k].look({7.5, 9}).row);
  }
  EXPECT_TRUE(read->weights().ok());
}

TEST_F(RegistrationFile, keeps_the_shift_of_a_camera_with_a_pixel_for_each_cell) {
  Registration written = small_registration();
  ASSERT_TRUE(save_registration(file(), written).ok());
  EXPECT_FALSE(load_registration(file())->shift.has_value());
  written.shift = Point{0.01, -0.02};
  ASSERT_TRUE(save_registration(file(), written).ok());
  // Its camera has more pixels than cells.
  EXPECT_EQ(load_registration(file()).error().code, ErrorCode::bad_format);
  written.cells = written.camera();
  ASSERT_TRUE(save_registration(file(), written).ok());
  const auto read = load_registration(file());
  ASSERT_TRUE(read.ok()) << read.error().line();
  ASSERT_TRUE(read->shift.has_value());
  EXPECT_EQ(read->shift->col, -0.02);
}

Registration with_ghost(double share, double sigma, Point place) {
  Registration one = small_registration();
  one.ghost.found = true;
  one.ghost.share = share;
  one.ghost.sigma = sigma;
  one.ghost.place = place;
  one.ghost.significance = 12;
  return one;
}

TEST_F(RegistrationFile, keeps_a_ghost) {
  ASSERT_TRUE(save_registration(file(), small_registration()).ok());
  EXPECT_FALSE(load_registration(file())->ghost.found);
  ASSERT_TRUE(save_registration(file(), with_ghost(0.0123, 0.001, {4.3, -2.6})).ok());
  const auto read = load_registration(file());
  ASSERT_TRUE(read.ok()) << read.error().line();
  EXPECT_TRUE(read->ghost.found);
  EXPECT_EQ(read->ghost.share, 0.0123);
  EXPECT_EQ(read->ghost.sigma, 0.001);
  EXPECT_EQ(read->ghost.significance, 12);
  EXPECT_EQ(read->ghost.place.row, 4.3);
  EXPECT_EQ(read->ghost.place.col, -2.6);
  EXPECT_TRUE(read->weights().ok());
  EXPECT_NE(read->weights()->digest(), small_registration().weights()->digest());
}

TEST_F(RegistrationFile, keeps_the_ghost_of_a_camera_with_a_pixel_for_each_cell) {
  Registration written = with_ghost(0.01, 0.001, {3, 3});
  written.cells = written.camera();
  written.shift = Point{0.01, 0.01};
  ASSERT_TRUE(save_registration(file(), written).ok());
  const auto read = load_registration(file());
  ASSERT_TRUE(read.ok()) << read.error().line();
  EXPECT_TRUE(read->shift.has_value() && read->ghost.found);
  const auto weights = read->weights();
  ASSERT_TRUE(weights.ok()) << weights.error().line();
  EXPECT_EQ(weights->digest(), written.weights()->digest());
}

TEST_F(RegistrationFile, keeps_what_reciprocity_found) {
  Registration one = small_registration();
  one.reciprocity = {.corrected = 0.003, .left = 0.0002, .measured = true};
  ASSERT_TRUE(save_registration(file(), one).ok());
  const auto read = load_registration(file());
  ASSERT_TRUE(read.ok()) << read.error().line();
  EXPECT_TRUE(read->reciprocity.measured);
  EXPECT_EQ(read->reciprocity.corrected, 0.003);
  EXPECT_EQ(read->reciprocity.left, 0.0002);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double wrong : {-0.1, 101.0, nan}) {
    one.reciprocity.left = wrong;
    ASSERT_TRUE(save_registration(file(), one).ok());
    EXPECT_EQ(load_registration(file()).error().code, ErrorCode::bad_value) << wrong;
  }
}

TEST_F(RegistrationFile, a_ghost_that_cannot_be_is_refused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Registration& wrong :
       {with_ghost(0, 0.1, {3, 3}), with_ghost(-0.01, 0.1, {3, 3}), with_ghost(0.5, 0.1, {3, 3}),
        with_ghost(nan, 0.1, {3, 3}), with_ghost(0.01, -1, {3, 3}), with_ghost(0.01, nan, {3, 3}),
        with_ghost(0.01, 0.1, {5.1, 0}), with_ghost(0.01, 0.1, {0, nan})}) {
    ASSERT_TRUE(save_registration(file(), wrong).ok());
    const auto read = load_registration(file());
    ASSERT_FALSE(read.ok()) << wrong.ghost.share;
    EXPECT_EQ(read.error().code, ErrorCode::bad_value) << read.error().line();
  }
}

TEST_F(RegistrationFile, a_file_that_is_cut_short_is_refused) {
  ASSERT_TRUE(save_registration(file(), small_registration()).ok());
  const auto whole = read_file(file());
  ASSERT_TRUE(whole.ok());
  for (std::size_t size = 0; size < whole->size(); size += 97) {
    const Error error = error_of(std::span(*whole).first(size));
    EXPECT_EQ(error.code, ErrorCode::bad_format) << size;
    EXPECT_NE(error.line().find("calibrate"), std::string::npos) << error.line();
  }
}

// Datasets and metadata have checksums. A flip in a byte that nothing uses may pass unseen, but then the
// content is the same.
TEST_F(RegistrationFile, a_flipped_bit_is_seen_or_does_no_harm) {
  const Registration written = small_registration();
  ASSERT_TRUE(save_registration(file(), written).ok());
  const auto whole = read_file(file());
  ASSERT_TRUE(whole.ok());
  int seen = 0, tried = 0;
  for (std::size_t at = 0; at < whole->size(); at += 61, ++tried) {
    auto bytes = *whole;
    bytes[at] ^= std::byte{1} << (at % 8);
    ASSERT_TRUE(write_file_atomically(file(), std::span<const std::byte>(bytes)).ok());
    const auto read = load_registration(file());
    if (!read) {
      ++seen;
      continue;
    }
    EXPECT_TRUE(std::ranges::equal(read->flood.mean.values(), written.flood.mean.values())) << at;
    EXPECT_EQ(read->maps[0].numbers().row, written.maps[0].numbers().row) << at;
    EXPECT_EQ(read->cells, written.cells) << at;
  }
  EXPECT_GT(seen, tried / 4);
}

TEST_F(RegistrationFile, other_files_are_named) {
  const auto missing = load_registration(folder_ / "none.h5");
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, ErrorCode::not_found);
  EXPECT_NE(missing.error().line().find("symrig calibrate"), std::string::npos);
  TensorBuilder builder(BlockTree(Grid{2, 2}), 1);
  ASSERT_TRUE(save_scene(file(), {std::move(builder).finish(), "{}", {}}).ok());
  const auto scene = load_registration(file());
  ASSERT_FALSE(scene.ok());
  EXPECT_EQ(scene.error().code, ErrorCode::bad_format);
  EXPECT_NE(scene.error().line().find("symrig-scene"), std::string::npos) << scene.error().line();
}

TEST(CameraMapNumbers, that_no_map_has_are_refused) {
  const CameraMapNumbers good = small_registration().maps.front().numbers();
  ASSERT_TRUE(CameraMap::make(good).ok());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<CameraMapNumbers> wrong(9, good);
  wrong[0].camera = {0, 3};
  wrong[1].intervals = 0;
  wrong[2].intervals = std::numeric_limits<int>::max();
  wrong[3].row.pop_back();
  wrong[4].col.back() = nan;
  wrong[5].row.front() = 1e300;
  wrong[6].error = nan;
  wrong[7].outlier_share = 1.5;
  wrong[8].edges = -1;
  for (const CameraMapNumbers& one : wrong) {
    const auto map = CameraMap::make(one);
    ASSERT_FALSE(map.ok());
    EXPECT_EQ(map.error().code, ErrorCode::bad_value);
  }
}

// Its scene exchanges too little light to tell any gain.
TEST(GainlessRegistration, is_read_again) {
  const auto rig = open_virtual_rig(
      "sim:random?seed=18&size=32x32&fine=4&camera=152x152&turn=1.5&zoom=0.784&shift=3.3,-2.1&distortion=0."
      "02");
  ASSERT_TRUE(rig.ok());
  const auto registration = register_camera(**rig);
  ASSERT_TRUE(registration.ok()) << registration.error().line();
  EXPECT_FALSE(registration->gain.known);
  const test::Scratch folder;
  ASSERT_TRUE(save_registration(folder / "r.h5", *registration).ok());
  const auto read = load_registration(folder / "r.h5");
  EXPECT_TRUE(read.ok()) << read.error().line();
}

}  // namespace
}  // namespace symrig::registration_file_test
