// SPDX-License-Identifier: Apache-2.0
// A matrix as its file holds it, and the readers of the formats.
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/grid.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace symrig::sim {

inline constexpr std::int64_t kMostDensePixels = 1 << 16;  // 16 GiB of floats

enum class NumberType : std::uint8_t { f32, f64, i8, u8, i16, u16, i32, u32 };
std::size_t size_of(NumberType type);

struct RawMatrix {
  std::vector<std::byte> bytes = {};  ///< little-endian numbers from `data` on
  std::size_t data = 0;
  NumberType type = NumberType::f32;
  std::vector<std::int64_t> shape = {};  ///< of T[i, j] or T[row, col, row, col]: camera, then projector
  bool columns_first = false;            ///< the first index runs fastest, as in MATLAB
  bool matlab_pixels = false;            ///< pixels are numbered column after column
  Grid grid = {};                        ///< as the file states it; 0x0: it states none

  double at(std::size_t k) const;  ///< number k in the order of the file
};

/// [n, n] or [rows, cols, rows, cols], each size from 1 to kMostDensePixels.
bool is_matrix_shape(const std::vector<std::int64_t>& shape);

/// The size of a picture that a file states as numbers.  fails: bad_format.
Result<Grid> stated_size(double rows, double cols, const std::string& name);

/// The error bad_format of a file with its usual next step.
Error no_matrix(const std::string& file, const std::string& why);

/// NumPy Enhancement Proposal 1, versions 1 to 3, in either byte order.
Result<RawMatrix> read_npy(std::vector<std::byte> bytes, const std::string& file);
bool is_mat(std::string_view bytes);
/// MATLAB's formats: level 4, level 5, and level 5 with compression (level 7).  source: "MAT-File Format",
/// The MathWorks. The variable T, or the only one with the shape of a matrix.
Result<RawMatrix> read_mat(std::vector<std::byte> bytes, const std::string& file);
/// HDF5: the data set T, or the only one with the shape of a matrix. matlab: a MAT file of level 7.3.
Result<RawMatrix> read_hdf(const std::filesystem::path& file, bool matlab);

}  // namespace symrig::sim
