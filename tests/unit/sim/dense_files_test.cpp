// SPDX-License-Identifier: Apache-2.0
// Matrices in MAT and HDF5 files. tests/python/dense_files_test.py writes them with SciPy and h5py.

#include "mat_bytes.hpp"
#include "scratch.hpp"
#include "symrig/sim/dense_rig.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "tensor/h5_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::dense_files_test {

namespace {

using test::level4_variable, test::mat_compressed, test::mat_file, test::mat_variable, test::raw_bytes;

/// T of a picture of 2x3: entry 10 i + j for camera pixel i and projector pixel j, in raster order.
constexpr Grid kGrid{2, 3};
constexpr std::size_t kPixels = 6;

float entry(std::size_t i, std::size_t j) {
  return static_cast<float>(10 * i + j);
}

/// The raster index of MATLAB's pixel k.
std::size_t raster(std::size_t k) {
  return k % 2 * 3 + k / 2;
}

/// The numbers as MATLAB stores T: column after column, and each picture column after column.
template <class T>
std::string matlab_numbers() {
  std::vector<T> values;
  for (std::size_t j = 0; j < kPixels; ++j)
    for (std::size_t i = 0; i < kPixels; ++i) values.push_back(static_cast<T>(entry(raster(i), raster(j))));
  return raw_bytes(std::span<const T>(values));
}

std::string size_numbers() {
  const std::vector<double> size{2, 3};
  return raw_bytes(std::span<const double>(size));
}

class DenseFiles : public testing::Test {
 protected:
  Result<DenseMatrix> read(const std::string& bytes, Grid grid = {}) {
    std::ofstream(path_, std::ios::binary) << bytes;
    return read_dense({path_, grid});
  }
  static void expect_matrix(const Result<DenseMatrix>& read) {
    ASSERT_TRUE(read.ok()) << read.error().line();
    EXPECT_EQ(read->grid, kGrid);
    for (std::size_t i = 0; i < kPixels; ++i)
      for (std::size_t j = 0; j < kPixels; ++j) EXPECT_EQ(read->values[i * kPixels + j], entry(i, j));
  }
  void expect_refusal(const std::string& bytes, const std::string& why) {
    const auto refused = read(bytes, kGrid);
    ASSERT_FALSE(refused.ok()) << why;
    EXPECT_EQ(refused.error().code, ErrorCode::bad_format) << refused.error().line();
    EXPECT_NE(refused.error().line().find(why), std::string::npos) << refused.error().line();
    EXPECT_NE(refused.error().line().find("T.any"), std::string::npos) << refused.error().line();
  }

  test::Scratch folder_;
  std::filesystem::path path_ = folder_ / "T.any";  // the name says nothing
  const std::string size_ = mat_variable("light_size", 1, 2, 9, size_numbers());
  const std::string doubles_ = mat_variable("T", kPixels, kPixels, 9, matlab_numbers<double>());
};

TEST_F(DenseFiles, level_5_with_and_without_compression) {
  expect_matrix(read(mat_file(doubles_), kGrid));
  expect_matrix(read(mat_file(size_ + doubles_)));
  expect_matrix(read(mat_file(mat_compressed(doubles_) + mat_compressed(size_))));
}

TEST_F(DenseFiles, level_5_of_every_stored_type) {
  expect_matrix(read(mat_file(mat_variable("T", kPixels, kPixels, 7, matlab_numbers<float>(), 7)), kGrid));
  expect_matrix(
      read(mat_file(mat_variable("T", kPixels, kPixels, 2, matlab_numbers<std::uint8_t>())), kGrid));
  expect_matrix(
      read(mat_file(mat_variable("T", kPixels, kPixels, 3, matlab_numbers<std::int16_t>())), kGrid));
  expect_matrix(
      read(mat_file(mat_variable("T", kPixels, kPixels, 6, matlab_numbers<std::uint32_t>())), kGrid));
}

TEST_F(DenseFiles, level_4_as_export_writes_it) {
  const std::string size = level4_variable("photo_size", 1, 2, 0, size_numbers());
  expect_matrix(read(size + level4_variable("T", kPixels, kPixels, 10, matlab_numbers<float>())));
  expect_matrix(read(level4_variable("T", kPixels, kPixels, 0, matlab_numbers<double>()), kGrid));
}

TEST_F(DenseFiles, the_only_matrix_needs_no_name) {
  const std::string other = mat_variable("A", kPixels, kPixels, 9, matlab_numbers<double>());
  expect_matrix(read(mat_file(size_ + other)));
  expect_matrix(read(mat_file(other + doubles_ + size_)));
  const std::string second = mat_variable("B", kPixels, kPixels, 9, matlab_numbers<double>());
  expect_refusal(mat_file(other + second), "several matrices");
  expect_refusal(mat_file(size_), "no matrix");
}

TEST_F(DenseFiles, what_is_no_real_matrix_is_refused) {
  const std::string numbers = matlab_numbers<double>();
  expect_refusal(mat_file(mat_variable("T", kPixels, kPixels, 9, numbers, 6 | 0x800)), "complex");
  expect_refusal(mat_file(mat_variable("T", kPixels, kPixels, 9, numbers, 5)), "sparse");
  expect_refusal(mat_file(mat_variable("T", kPixels, kPixels, 9, numbers, 4)), "no numeric array");
  expect_refusal(mat_file(mat_variable("T", kPixels, 7, 9, numbers)), "damaged");
  expect_refusal("MATLAB 7.3 MAT-file, without HDF5", "neither");
  const std::string text = level4_variable("T", kPixels, kPixels, 1, numbers);
  expect_refusal(text, "text or sparse");
}

/// The compressed bytes cannot hold what the variable claims: nothing of that size is allocated.
TEST_F(DenseFiles, a_bomb_is_refused) {
  std::string huge = mat_variable("T", 60'000, 60'000, 2, std::string(64, '\0'));
  const std::string size = test::word_bytes({3'600'000'000U});
  huge.replace(4, 4, size);                 // of the matrix element
  huge.replace(huge.size() - 68, 4, size);  // of its numbers
  expect_refusal(mat_file(mat_compressed(huge)), "claims more bytes");
}

TEST_F(DenseFiles, every_cut_file_is_refused) {
  for (const std::string& whole : {mat_file(mat_compressed(doubles_)), mat_file(doubles_),
                                   level4_variable("T", kPixels, kPixels, 10, matlab_numbers<float>())}) {
    ASSERT_TRUE(read(whole, kGrid).ok());
    for (std::size_t size = 0; size < whole.size(); ++size)
      EXPECT_FALSE(read(whole.substr(0, size), kGrid).ok()) << size;
  }
}

/// Writes an HDF5 file with these data sets [n, n].
void write_hdf(const std::filesystem::path& path, const std::vector<std::string>& names, bool as_doubles) {
  std::vector<float> floats;
  for (std::size_t i = 0; i < kPixels; ++i)
    for (std::size_t j = 0; j < kPixels; ++j) floats.push_back(entry(i, j));
  const std::vector<double> doubles(floats.begin(), floats.end());
  namespace h5 = tensor::h5;
  const auto written = h5::write_file(path, [&](hid_t file) {
    for (const std::string& name : names) {
      const h5::Shape shape{kPixels, kPixels};
      const bool good = as_doubles ? h5::write_dataset<double>(file, name.c_str(), shape, doubles)
                                   : h5::write_dataset<float>(file, name.c_str(), shape, floats);
      if (!good) return false;
    }
    return true;
  });
  ASSERT_TRUE(written.ok()) << written.error().line();
}

TEST_F(DenseFiles, hdf5) {
  write_hdf(path_, {"T"}, false);
  expect_matrix(read_dense({path_, kGrid}));
  write_hdf(path_, {"other", "T"}, true);
  expect_matrix(read_dense({path_, kGrid}));
  write_hdf(path_, {"transport"}, true);
  expect_matrix(read_dense({path_, kGrid}));
  write_hdf(path_, {"a", "b"}, true);
  EXPECT_EQ(read_dense({path_, kGrid}).error().code, ErrorCode::bad_format);
  write_hdf(path_, {}, true);
  EXPECT_NE(read_dense({path_, kGrid}).error().line().find("no matrix"), std::string::npos);
}

// MATLAB's sparse matrices are groups with this attribute.
TEST_F(DenseFiles, a_group_is_called_what_it_is) {
  namespace h5 = tensor::h5;
  const auto write_group = [&](bool sparse) {
    const auto written = h5::write_file(path_, [&](hid_t file) {
      h5::Handle group = h5::new_group(file, "T");
      const std::int32_t rows = kPixels;
      return group.ok() &&
             (!sparse || h5::write_attribute(group.id(), "MATLAB_sparse", std::span(&rows, 1))) &&
             group.close();
    });
    ASSERT_TRUE(written.ok()) << written.error().line();
  };
  write_group(true);
  EXPECT_NE(read_dense({path_, kGrid}).error().line().find("T is sparse: give full(T)"), std::string::npos)
      << read_dense({path_, kGrid}).error().line();
  write_group(false);
  EXPECT_NE(read_dense({path_, kGrid}).error().line().find("T is a group"), std::string::npos);
}

/// A .npy file. size: bytes of the length of its head.
std::string npy(int version, std::size_t size, const std::string& kind, const std::string& numbers) {
  const std::string head = "{'descr': '" + kind + "', 'fortran_order': False, 'shape': (6, 6), }\n";
  std::string file = "\x93NUMPY" + std::string{static_cast<char>(version), 0};
  for (std::size_t k = 0; k < size; ++k) file += static_cast<char>(k == 0 ? head.size() : 0);
  return file + head + numbers;
}

template <class T>
std::string raster_numbers(bool swapped) {
  std::string all;
  for (std::size_t i = 0; i < kPixels; ++i)
    for (std::size_t j = 0; j < kPixels; ++j) {
      const auto value = static_cast<T>(entry(i, j));
      std::string one = raw_bytes(std::span<const T>(&value, 1));
      if (swapped) std::reverse(one.begin(), one.end());
      all += one;
    }
  return all;
}

TEST_F(DenseFiles, npy_of_every_version_in_either_byte_order) {
  for (const int version : {1, 2, 3}) {
    const std::size_t size = version == 1 ? 2 : 4;
    expect_matrix(read(npy(version, size, "<f4", raster_numbers<float>(false)), kGrid));
    expect_matrix(read(npy(version, size, ">f4", raster_numbers<float>(true)), kGrid));
    expect_matrix(read(npy(version, size, "<f8", raster_numbers<double>(false)), kGrid));
    expect_matrix(read(npy(version, size, ">f8", raster_numbers<double>(true)), kGrid));
  }
  expect_refusal(npy(4, 4, "<f4", raster_numbers<float>(false)), "is of version 4.0 of .npy");
  expect_refusal(npy(1, 2, "<c8", raster_numbers<double>(false)), "its numbers are '<c8'");
  expect_refusal("PK\x03\x04" + std::string(60, '\0'), "ZIP archive");
  expect_refusal("# Created by Octave 9.2.0", "Octave's text format");
}

}  // namespace

}  // namespace symrig::dense_files_test

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

// The matrix as the scene of a simulated rig.

constexpr std::size_t kLitPixels = 64;

/// T of 8x8 pixels: direct light, and light between neighbours in raster order. scale: of its unit.
std::vector<float> lit_matrix(float scale) {
  std::vector<float> values(kLitPixels * kLitPixels);
  for (std::size_t i = 0; i < 64; ++i)
    for (std::size_t j = 0; j < 64; ++j)
      values[i * 64 + j] = scale * (i == j                     ? 0.5F + 0.005F * static_cast<float>(i)
                                    : i + 1 == j || j + 1 == i ? 0.1F
                                                               : 0);
  return values;
}

TEST_F(DenseRig, with_keys_of_a_rig_it_is_the_scene_of_one) {
  const auto matrix = read(npy(lit_matrix(1), "(64, 64)"));
  ASSERT_TRUE(matrix.ok()) << matrix.error().line();
  const auto exact = make_dense_rig(*matrix, "");
  const std::string uri = "dense:" + path_.string() + "?noise=off&profile=video";
  const auto rig = open_virtual_rig(uri);
  ASSERT_TRUE(rig.ok()) << rig.error().line();
  EXPECT_EQ((*rig)->grid(), (Grid{8, 8}));
  Pattern pattern((*rig)->grid());
  for (std::size_t i = 0; i < 64; i += 3) pattern.values()[i] = 1;
  const auto seen = (*rig)->measure(std::span(&pattern, 1)),
             expected = exact->measure(std::span(&pattern, 1));
  ASSERT_TRUE(seen.ok()) << seen.error().line();
  for (std::size_t i = 0; i < 64; ++i)
    EXPECT_FLOAT_EQ(seen->front().mean.values()[i], expected->front().mean.values()[i]);
  EXPECT_GT((*rig)->cost().rig_seconds, 0);
  // Its name says the same again.
  const auto again = parse_scene_uri((*rig)->uri().to_string());
  ASSERT_TRUE(again.ok()) << again.error().line();
  EXPECT_EQ(again->to_string(), (*rig)->uri().to_string());
  EXPECT_EQ(again->profile, "video");
}

// The camera sees as much of any unit: noise is below 5 % of what is lit, and time is the same.
TEST_F(DenseRig, exposures_fit_light_of_any_unit) {
  std::vector<double> seconds;
  for (const float scale : {1e-6F, 1.F, 1e5F}) {
    ASSERT_TRUE(read(npy(lit_matrix(scale), "(64, 64)")).ok());
    const auto rig = open_virtual_rig("dense:" + path_.string() + "?noise=camera&black=0");
    ASSERT_TRUE(rig.ok()) << rig.error().line();
    Pattern white((*rig)->grid(), 1, 1.F);
    const auto seen = (*rig)->measure(std::span(&white, 1));
    ASSERT_TRUE(seen.ok()) << seen.error().line();
    const double mean = seen->front().mean.values()[20],
                 sigma = std::sqrt(seen->front().variance.values()[20]);
    EXPECT_NEAR(mean / static_cast<double>(scale), 0.8, 5 * sigma / static_cast<double>(scale));
    EXPECT_LT(sigma, 0.05 * mean);
    seconds.push_back((*rig)->cost().rig_seconds);
  }
  EXPECT_DOUBLE_EQ(seconds[0], seconds[1]);
  EXPECT_DOUBLE_EQ(seconds[2], seconds[1]);
}

TEST_F(DenseRig, what_no_simulated_rig_can_have_is_refused) {
  ASSERT_TRUE(read(npy(lit_matrix(1), "(64, 64)")).ok());
  const auto line = [&](const std::string& query) {
    const auto uri = parse_scene_uri("dense:" + path_.string() + "?" + query);
    return uri.ok() ? std::string() : uri.error().line();
  };
  for (const char* const query : {"size=8x8", "channels=3", "indirect=2", "parallax=1"})
    EXPECT_NE(line(query).find("remove the keys size, channels, indirect and parallax"), std::string::npos)
        << query;
  EXPECT_NE(line("fine=3").find("does not divide"), std::string::npos);
  EXPECT_NE(line("nois=off").find("did you mean 'noise'?"), std::string::npos);
  EXPECT_NE(line("profile=slow").find("profile"), std::string::npos);
  auto negative = lit_matrix(1);
  negative[7] = -0.1F;
  ASSERT_TRUE(read(npy(negative, "(64, 64)")).ok());
  EXPECT_NE(line("noise=camera").find("negative light"), std::string::npos);
  EXPECT_TRUE(read(npy(std::vector<float>(kLitPixels * kLitPixels, 0.F), "(64, 64)")).error().code ==
              ErrorCode::bad_value);
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
