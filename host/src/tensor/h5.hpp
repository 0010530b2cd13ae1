// SPDX-License-Identifier: Apache-2.0
// The part of HDF5 that scene.h5 needs, with handles that close themselves and errors as Result.
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/grid.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <hdf5.h>

namespace symrig::tensor::h5 {

/// An HDF5 identifier and the function that closes it.
class Handle {
 public:
  Handle() = default;
  Handle(hid_t id, herr_t (*close_by)(hid_t)) : id_(id), close_(close_by) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_(other.close_) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() { close(); }

  bool ok() const { return id_ >= 0; }
  hid_t id() const { return id_; }
  /// Closes now. Returns false if the library failed, for example because the disk is full.
  bool close() {
    if (!ok()) return true;
    return close_(std::exchange(id_, H5I_INVALID_HID)) >= 0;
  }

 private:
  hid_t id_ = H5I_INVALID_HID;
  herr_t (*close_)(hid_t) = nullptr;
};

template <class T>
hid_t native();
template <>
inline hid_t native<std::int8_t>() {
  return H5T_NATIVE_INT8;
}
template <>
inline hid_t native<std::int32_t>() {
  return H5T_NATIVE_INT32;
}
template <>
inline hid_t native<std::int64_t>() {
  return H5T_NATIVE_INT64;
}
template <>
inline hid_t native<float>() {
  return H5T_NATIVE_FLOAT;
}
template <>
inline hid_t native<double>() {
  return H5T_NATIVE_DOUBLE;
}
template <>
inline hid_t native<std::uint8_t>() {
  return H5T_NATIVE_UINT8;
}
/// The type of a 16-bit float. HDF5 has no name for it, but readers recognise it by its bits.
hid_t half_type();
template <>
inline hid_t native<std::uint16_t>() {
  return half_type();
}

/// Shape of a dataset, slowest dimension first.
using Shape = std::vector<hsize_t>;
hsize_t count(const Shape& shape);

/// Stops HDF5 from printing its error stack; errors are returned as values.
void be_quiet();

/// Values of a chunk of a dataset.
inline constexpr std::size_t kRunChunk = std::size_t{1} << 20;

// Writing: returns false if the library failed.
bool write_attribute(hid_t object, const char* name, const std::string& text);
bool write_attribute(hid_t object, const char* name, std::span<const std::int32_t> values);
bool write_attribute(hid_t object, const char* name, double value);
bool write_dataset(hid_t place, const char* name, hid_t type, const Shape& shape, const void* data);
template <class T>
bool write_dataset(hid_t place, const char* name, const Shape& shape, std::span<const T> data) {
  return write_dataset(place, name, native<T>(), shape, data.data());
}

/// A new dataset of one dimension, written as its values come.
template <class T>
class NewRun {
 public:
  NewRun(hid_t place, const char* name, std::size_t size);

  bool ok() const { return dataset_.ok(); }
  bool add(std::span<const T> values) {
    waiting_.insert(waiting_.end(), values.begin(), values.end());
    return waiting_.size() < kTogether || write(waiting_.size() / kRunChunk * kRunChunk);
  }
  /// Writes what waits, and closes.
  bool close() { return write(waiting_.size()) && dataset_.close(); }

 private:
  static constexpr std::size_t kTogether = 8 * kRunChunk;  // whole chunks, so that each is written once
  bool write(std::size_t count);

  Handle dataset_;
  std::size_t written_ = 0;
  std::vector<T> waiting_;
};

/// Makes a group. Not ok() if the library failed.
Handle new_group(hid_t place, const std::string& name);
/// Not ok() if it is missing, or behind a link to another file.
Handle open_group(hid_t file, const std::string& path);

// Reading: every failure is bad_format and names the dataset or attribute. It has no hint: read_file() adds
// it.
/// A text of fixed or variable length, ASCII or UTF-8.
Result<std::string> read_text(hid_t object, const char* name);
Result<std::vector<std::int32_t>> read_integers(hid_t object, const char* name, std::size_t expected);
Result<double> read_number(hid_t object, const char* name);
/// Rows and columns.
Result<Grid> read_grid(hid_t object, const char* name);

/// Shape of a dataset. Refused if its data do not fit into `file_bytes`, so that a corrupt size does not
/// cause a large allocation.
Result<Shape> shape_of(hid_t place, const char* name, std::size_t rank, std::size_t element_bytes,
                       std::uint64_t file_bytes);
Result<void> read_into(hid_t place, const char* name, hid_t type, void* data);

/// Reads values [first, first + count) of a dataset of one dimension, or such rows of one of two.
Result<void> read_run(hid_t place, const char* name, hid_t type, hsize_t first, const Shape& run, void* data);
template <class T>
Result<void> read_run(hid_t place, const char* name, std::size_t first, std::span<T> to) {
  return read_run(place, name, native<T>(), first, {to.size()}, to.data());
}
/// to: whole rows of `width` values.
template <class T>
Result<void> read_rows(hid_t place, const char* name, std::size_t first, std::size_t width, std::span<T> to) {
  return read_run(place, name, native<T>(), first, {to.size() / width, width}, to.data());
}

template <class T>
Result<std::vector<T>> read_dataset(hid_t place, const char* name, std::size_t rank, std::uint64_t file_bytes,
                                    Shape& shape) {
  auto found = shape_of(place, name, rank, sizeof(T), file_bytes);
  if (!found) return std::move(found).error();
  shape = *std::move(found);
  std::vector<T> values(count(shape));
  SYMRIG_CHECK(read_into(place, name, native<T>(), values.data()));
  return values;
}

}  // namespace symrig::tensor::h5
