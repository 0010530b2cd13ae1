// SPDX-License-Identifier: Apache-2.0
// The heaps in which HDF5 keeps links, attributes and texts.
#pragma once

#include "tensor/h5_reader/file_bytes.hpp"

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace symrig::tensor::h5 {

/// A fractal heap: links and attributes of objects that have many.
class FractalHeap {
 public:
  /// fails: bad_format.
  static Result<FractalHeap> open(const FileBytes& file, Address header);

  /// The object that an ID names.  fails: bad_format.
  Result<std::vector<std::uint8_t>> object(std::span<const std::uint8_t> id);
  std::uint64_t id_bytes() const { return id_bytes_; }

 private:
  struct Place {
    Address at;
    std::uint64_t size;
  };

  explicit FractalHeap(const FileBytes& file) : file_(&file) {}
  Result<void> read_head(Address header);
  Result<std::vector<std::uint8_t>> managed(std::uint64_t offset, std::uint64_t size);
  Result<std::vector<std::uint8_t>> huge(Bytes id);
  Result<void> list_huge();
  Result<Place> direct_block(std::uint64_t& offset) const;
  Result<Address> child_of(Address block, std::uint64_t rows, std::uint64_t row, std::uint64_t col) const;
  std::uint64_t row_size(std::uint64_t row) const { return row < 2 ? start_ : start_ << (row - 1); }
  Result<void> load(Place block);

  const FileBytes* file_;
  std::uint64_t id_bytes_ = 0, offset_bytes_ = 0, size_bytes_ = 0;
  std::uint64_t width_ = 0, start_ = 0, largest_ = 0, direct_rows_ = 0, root_rows_ = 0;
  bool checked_ = false;  ///< direct blocks have checksums
  Address root_ = kUndefined, huge_tree_ = kUndefined;
  bool huge_listed_ = false;
  std::map<std::uint64_t, Place> huge_;
  Address loaded_ = kUndefined;  ///< the block that was read last
  std::vector<std::uint8_t> block_;
};

/// A text of a local heap: the heap of an old group.  fails: bad_format.
class LocalHeap {
 public:
  static Result<LocalHeap> open(const FileBytes& file, Address header);
  Result<std::string> text(std::uint64_t offset) const;

 private:
  std::vector<std::uint8_t> texts_;
};

/// An object of a global heap: a text of variable length.  fails: bad_format.
Result<std::vector<std::uint8_t>> global_object(const FileBytes& file, Address collection,
                                                std::uint64_t index);

}  // namespace symrig::tensor::h5
