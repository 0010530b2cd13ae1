// SPDX-License-Identifier: Apache-2.0
#include "symrig/sim/dense_rig.hpp"

#include "scratch.hpp"

#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::dense_rig_test {
namespace {

constexpr std::size_t kHead = 128;

/// A .npy file of 32-bit floats as numpy.save() writes it.
std::string npy(const std::vector<float>& values, const std::string& shape) {
  std::string dictionary = "{'descr': '<f4', 'fortran_order': False, 'shape': " + shape + ", }";
  dictionary.append(kHead - 10 - dictionary.size() - 1, ' ');
  std::string file = std::string("\x93NUMPY\x01", 7) + '\0' + static_cast<char>(kHead - 10) + '\0';
  file += dictionary + '\n';
  file.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
  return file;
}

class DenseRig : public testing::Test {
 protected:
  Result<DenseMatrix> read(const std::string& bytes, Grid grid = {}, ViewLayout views = {}) {
    std::ofstream(path_, std::ios::binary) << bytes;
    return read_dense({path_, grid, views});
  }

  test::Scratch folder_;
  std::filesystem::path path_ = folder_ / "T.npy";
  std::vector<float> values_{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
};

TEST_F(DenseRig, a_photograph_is_the_matrix_times_the_pattern) {
  auto matrix = read(npy(values_, "(4, 4)"), Grid{1, 4});
  ASSERT_TRUE(matrix.ok()) << matrix.error().line();
  EXPECT_EQ(matrix->values, values_);
  EXPECT_DOUBLE_EQ(asymmetry(*matrix), 9.0 / 16);
  const auto rig = make_dense_rig(*std::move(matrix), "dense:T.npy");
  Pattern pattern(Grid{1, 4});
  pattern.values()[1] = 1;
  pattern.values()[3] = 0.5F;
  const auto seen = rig->measure(std::span(&pattern, 1));
  ASSERT_TRUE(seen.ok());
  const std::span<const float> mean = seen->front().mean.values();
  EXPECT_EQ(std::vector<float>(mean.begin(), mean.end()), (std::vector<float>{4, 10, 16, 22}));
  EXPECT_EQ(rig->cost().photographs, 1);
}

TEST_F(DenseRig, the_grid_comes_from_the_shape_or_is_given) {
  EXPECT_EQ(read(npy(values_, "(4, 4)"))->grid, (Grid{2, 2}));
  EXPECT_EQ(read(npy(values_, "(1, 4, 1, 4)"))->grid, (Grid{1, 4}));
  EXPECT_EQ(read(npy(values_, "(4, 4)"), Grid{4, 1})->grid, (Grid{4, 1}));
  for (const char* shape : {"(16,)", "(2, 8)", "(1, 4, 4, 1)", "()"})
    EXPECT_EQ(read(npy(values_, shape)).error().code, ErrorCode::size_mismatch) << shape;
  EXPECT_EQ(read(npy(values_, "(4, 4)"), Grid{3, 2}).error().code, ErrorCode::size_mismatch);
}

TEST_F(DenseRig, every_cut_file_is_refused) {
  const std::string whole = npy(values_, "(4, 4)");
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(read(whole.substr(0, size)).ok()) << size;
  EXPECT_FALSE(read(whole + "x").ok());
  EXPECT_TRUE(read(whole).ok());
}

// Under a sanitizer this also shows that no byte of the head leads out of the file.
TEST_F(DenseRig, a_damaged_head_is_refused_or_harmless) {
  const std::string whole = npy(values_, "(4, 4)");
  std::size_t refused = 0;
  for (std::size_t at = 0; at < kHead; ++at)
    for (const char byte : {'\0', '\xFF', '(', '9', '\''}) {
      std::string file = whole;
      file[at] = byte;
      const auto matrix = read(file);
      refused += matrix.ok() ? 0 : 1;
      EXPECT_TRUE(!matrix || matrix->values.size() == values_.size());
    }
  EXPECT_GT(refused, 100U);
}

TEST_F(DenseRig, its_views_tile_its_grid) {
  const auto file = npy(values_, "(4, 4)");
  EXPECT_TRUE(read(file, {2, 2}, {2, 1}).ok());
  EXPECT_EQ(read(file, {2, 2}, {3, 1}).error().code, ErrorCode::bad_argument);
  auto matrix = read(file, {1, 4});
  ASSERT_TRUE(matrix.ok()) << matrix.error().line();
  EXPECT_EQ(make_dense_rig(*matrix, "dense:T.npy")->views(), ViewLayout{});
  EXPECT_EQ(make_dense_rig(*std::move(matrix), "dense:T.npy", {1, 2})->views(), (ViewLayout{1, 2}));
}

TEST(DenseUri, names_a_file_and_perhaps_a_grid) {
  EXPECT_TRUE(is_dense("dense:T.npy") && !is_dense("T.npy"));
  EXPECT_EQ(parse_dense_uri("dense:a?b.npy")->file, "a?b.npy");
  const auto uri = parse_dense_uri("dense:a?b.npy?grid=48x64");
  EXPECT_EQ(uri->file, "a?b.npy");
  EXPECT_EQ(uri->grid, (Grid{48, 64}));
  for (const char* wrong : {"", "4", "x", "0x4", "4x", "4x4x4", "-1x4", "99999999999999999999x1"})
    EXPECT_EQ(parse_dense_uri(std::string("dense:T.npy?grid=") + wrong).error().code, ErrorCode::bad_argument)
        << wrong;
}

TEST(DenseUri, names_views) {
  EXPECT_EQ(parse_dense_uri("dense:T.npy")->views, ViewLayout{});
  EXPECT_EQ(parse_dense_uri("dense:a?views.npy?views=2x3")->views, (ViewLayout{2, 3}));
  EXPECT_EQ(parse_dense_uri("dense:a?views=2x3?grid=4x4")->file, "a?views=2x3");
  for (const char* const query : {"grid=48x64&views=2x3", "views=2x3&grid=48x64"}) {
    const auto uri = parse_dense_uri(std::string("dense:T.npy?") + query);
    ASSERT_TRUE(uri.ok()) << query;
    EXPECT_EQ(uri->file, "T.npy");
    EXPECT_EQ(uri->grid, (Grid{48, 64}));
    EXPECT_EQ(uri->views, (ViewLayout{2, 3}));
  }
  for (const char* const wrong : {"views=", "views=2", "views=0x2", "views=2x2x2", "grid=4x4&",
                                  "grid=4x4&views", "grid=4x4&view=2x2", "grid=4x4&&views=2x2"})
    EXPECT_EQ(parse_dense_uri(std::string("dense:T.npy?") + wrong).error().code, ErrorCode::bad_argument)
        << wrong;
  EXPECT_NE(parse_dense_uri("dense:T.npy?grid=4x4&view=2x2").error().line().find("views"), std::string::npos);
}

}  // namespace
}  // namespace symrig::dense_rig_test
