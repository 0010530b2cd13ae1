// SPDX-License-Identifier: Apache-2.0
#include "sim/dense/mat_level4.hpp"
#include "sim/dense/mat_level5.hpp"
#include "sim/dense/raw_matrix.hpp"

#include <algorithm>
#include <cstring>
#include <optional>
#include <utility>

#include <fmt/format.h>

namespace symrig::sim {

std::uint32_t mat_word(std::string_view bytes, std::size_t at) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, sizeof word);
  return word;
}

/// Of sizes that are no matrix: more than any file holds.
std::uint64_t numbers_in(const std::vector<std::int64_t>& shape) {
  std::uint64_t count = 1;
  for (const std::int64_t size : shape) {
    if (size < 0 || size > (std::int64_t{1} << 31) || count > (std::uint64_t{1} << 40))
      return ~std::uint64_t{0} / 16;
    count *= static_cast<std::uint64_t>(size);
  }
  return count;
}

namespace {

/// The variable T, or the only one with the shape of a matrix.
Result<MatVariable> matrix_among(const std::vector<MatVariable>& all, const std::string& file) {
  const auto named = std::find_if(all.begin(), all.end(), [](const auto& one) { return one.name == "T"; });
  if (named != all.end()) return *named;
  std::vector<MatVariable> found;
  std::copy_if(all.begin(), all.end(), std::back_inserter(found),
               [](const auto& one) { return is_matrix_shape(one.shape) && numbers_in(one.shape) > 1; });
  if (found.size() == 1) return found.front();
  return no_matrix(file,
                   found.empty() ? "it holds no matrix" : "it holds several matrices, none of the name T");
}

/// The variable with its numbers.
Result<RawMatrix> numbers_of(const MatVariable& variable, std::vector<std::byte> bytes,
                             const std::string& file) {
  if (!variable.fault.empty()) return no_matrix(file, fmt::format("{} {}", variable.name, variable.fault));
  if (!variable.compressed.empty()) {
    SYMRIG_TRY(bytes, uncompressed(variable, file));
  }
  return RawMatrix{.bytes = std::move(bytes),
                   .data = variable.data,
                   .type = variable.type,
                   .shape = variable.shape,
                   .columns_first = true,
                   .matlab_pixels = true};
}

/// A variable of a few numbers; the file itself is not copied.
Result<RawMatrix> small_variable(MatVariable variable, const std::vector<std::byte>& bytes,
                                 const std::string& file) {
  if (!variable.compressed.empty() || !variable.fault.empty()) return numbers_of(variable, {}, file);
  const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(std::exchange(variable.data, 0));
  const std::uint64_t size = numbers_in(variable.shape) * size_of(variable.type);
  return numbers_of(variable, {begin, begin + static_cast<std::ptrdiff_t>(size)}, file);
}

/// The size that light_size or photo_size states; 0x0: the file has no such variable.
Result<Grid> stated_grid(const std::vector<MatVariable>& all, const std::vector<std::byte>& bytes,
                         const std::string& file) {
  for (const MatVariable& one : all) {
    if ((one.name != "light_size" && one.name != "photo_size") || numbers_in(one.shape) != 2) continue;
    SYMRIG_TRY(const RawMatrix size, small_variable(one, bytes, file));
    auto stated = stated_size(size.at(0), size.at(1), one.name);
    if (!stated) return no_matrix(file, stated.error().what);
    return stated;
  }
  return Grid{};
}

}  // namespace

bool is_mat(std::string_view bytes) {
  return is_level5(bytes) || is_level4(bytes);
}

Result<RawMatrix> read_mat(std::vector<std::byte> bytes, const std::string& file) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  SYMRIG_TRY(const std::vector<MatVariable> all,
             is_level5(text) ? level5_variables(text, file) : level4_variables(text, file));
  SYMRIG_TRY(const MatVariable matrix, matrix_among(all, file));
  SYMRIG_TRY(const Grid grid, stated_grid(all, bytes, file));
  SYMRIG_TRY(RawMatrix raw, numbers_of(matrix, std::move(bytes), file));
  raw.grid = grid;
  return raw;
}

}  // namespace symrig::sim
