// SPDX-License-Identifier: Apache-2.0
// Matrices in MAT and HDF5 files. tests/python/dense_files_test.py writes them with SciPy and h5py.
#include "mat_bytes.hpp"
#include "scratch.hpp"
#include "symrig/sim/dense_rig.hpp"
#include "tensor/h5_file.hpp"

#include <algorithm>
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
