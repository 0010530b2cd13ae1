// SPDX-License-Identifier: Apache-2.0
// The part of the HDF5 library that writes files, with handles that close themselves. h5_file.hpp reads.
#pragma once

#include "tensor/h5_reader/datatype.hpp"

#include <cstdint>
#include <filesystem>
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

/// Stops HDF5 from printing its error stack; errors are returned as values.
void be_quiet();

/// Values of a chunk of a dataset.
inline constexpr std::size_t kRunChunk = std::size_t{1} << 20;

// Writing: returns false if the library failed.
bool write_attribute(hid_t object, const char* name, const std::string& text);
bool write_attribute(hid_t object, const char* name, std::span<const std::int32_t> values);
bool write_attribute(hid_t object, const char* name, double value);
/// How the chunks of a dataset are stored: as they are, or with shuffle and gzip.
enum class Storing { plain, packed };
bool write_dataset(hid_t place, const char* name, hid_t type, const Shape& shape, const void* data,
                   Storing storing = Storing::plain);
template <class T>
bool write_dataset(hid_t place, const char* name, const Shape& shape, std::span<const T> data,
                   Storing storing = Storing::plain) {
  return write_dataset(place, name, native<T>(), shape, data.data(), storing);
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

/// Where HDF5 writes a new file. The library cannot end a file whose writing failed: it would end the
/// process. So its driver tells it that all is well, and remembers the first failure.
struct Output {
  int cause = 0;  ///< errno of the first failure, or 0
};

/// Creates a file that is written through `output`, which must outlive it. Metadata stay in memory until the
/// file is closed. Not ok() if it cannot be created: `output` has the cause.
Handle create_file(const std::filesystem::path& path, Output& output);

}  // namespace symrig::tensor::h5
