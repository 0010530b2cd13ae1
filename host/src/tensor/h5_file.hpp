// SPDX-License-Identifier: Apache-2.0
// Reads attributes and datasets of symrig's HDF5 files. Every failure is bad_format or io and names the
// attribute or dataset. It mostly has no hint: read_file() knows what kind of file it is.
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/grid.hpp"
#include "tensor/h5_reader/dataset.hpp"
#include "tensor/h5_reader/object.hpp"
#include "tensor/h5_write.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace symrig::tensor::h5 {

/// A group that must be there.
Result<Object> open_group(const Object& place, const std::string& path);
/// Whether there is an object of this name.
Result<bool> exists(const Object& place, const std::string& path);

/// A text of fixed or variable length, ASCII or UTF-8.
Result<std::string> read_text(const Object& object, const std::string& name);
Result<std::vector<std::int32_t>> read_integers(const Object& object, const std::string& name,
                                                std::size_t expected);
Result<double> read_number(const Object& object, const std::string& name);
/// Rows and columns.
Result<Grid> read_grid(const Object& object, const std::string& name);

/// A dataset that must be there.
Result<Dataset> open_dataset(const Object& place, const std::string& name);
/// The shape of a dataset. Refused if its data do not fit into the file, so that a corrupt size does not
/// cause a large allocation.
Result<Shape> shape_of(const Object& place, const std::string& name, std::size_t rank,
                       std::size_t element_bytes);

/// Reads rows [first, first + rows) of a dataset: `values` numbers.
Result<void> read_rows(const Object& place, const std::string& name, std::uint64_t first, std::uint64_t rows,
                       const Conversion& conversion, void* to, std::uint64_t values);
/// to: whole rows of `width` values.
template <class T>
Result<void> read_rows(const Object& place, const std::string& name, std::uint64_t first, std::size_t width,
                       std::span<T> to) {
  return read_rows(place, name, first, to.size() / width, conversion<T>(), to.data(), to.size());
}

template <class T>
Result<std::vector<T>> read_dataset(const Object& place, const std::string& name, std::size_t rank,
                                    Shape& shape) {
  auto found = shape_of(place, name, rank, sizeof(T));
  if (!found) return std::move(found).error();
  shape = *std::move(found);
  std::vector<T> values(count(shape));
  SYMRIG_CHECK(
      read_rows(place, name, 0, shape.empty() ? 1 : shape[0], conversion<T>(), values.data(), values.size()));
  return values;
}

// HDF5 files of symrig: written atomically, and opened with errors that say what to do.

/// What messages say of a kind of file.
struct FileWords {
  std::string_view content;     ///< "a scene"
  std::string_view name_one;    ///< what to do if another file was named
  std::string_view make_one;    ///< what to do if there is none
  std::string_view make_again;  ///< what to do if it is damaged
};

/// Opens a file to read it: its root. A lock keeps other programs from writing as long as it is open.
/// fails: not_found; io (also: another program has it open for writing); bad_format (not HDF5, or damaged).
Result<Object> open_file(const std::filesystem::path& path, const FileWords& words);

/// Fills a new file, syncs it to the disk, and puts it in the place of the old one. `fill` returns false if
/// the library failed. After a failure, the old file is as it was.
/// fails: io, not_found.
Result<void> write_file(const std::filesystem::path& path, const std::function<bool(hid_t file)>& fill);

/// Opens a file, reads it with `read`, and puts its path before each error of that. An error without a hint
/// gets one.
template <class Read>
auto read_file(const std::filesystem::path& path, const FileWords& words, Read read)
    -> decltype(read(std::declval<const Object&>())) {
  SYMRIG_TRY(const Object root, open_file(path, words));
  auto content = read(root);
  if (content) return content;
  Error error = std::move(content).error();
  error.what = path.string() + ": " + error.what;
  if (error.hint.empty())
    error.hint = std::string("the file is damaged or not ")
                     .append(words.content)
                     .append("; ")
                     .append(words.make_again);
  return error;
}

}  // namespace symrig::tensor::h5
