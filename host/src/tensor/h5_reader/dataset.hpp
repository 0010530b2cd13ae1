// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tensor/h5_reader/filters.hpp"
#include "tensor/h5_reader/layout.hpp"
#include "tensor/h5_reader/object.hpp"

#include <cstdint>
#include <utility>
#include <vector>

namespace symrig::tensor::h5 {

/// The values of a dataset.
class Dataset {
 public:
  /// fails: bad_format (no dataset, or one that is not read here).
  static Result<Dataset> open(const Object& object);

  const Datatype& type() const { return type_; }
  const Shape& shape() const { return space_.size; }
  /// No dataset of this file has more bytes.
  std::uint64_t most_bytes() const;
  /// Reads rows [first, first + rows) of the slowest dimension; a dataset without dimensions has one row.
  /// values: that the caller has room for, and expects.  fails: bad_format, io.
  Result<void> read(std::uint64_t first, std::uint64_t rows, const Conversion& conversion, void* to,
                    std::uint64_t values) const;

 private:
  /// Rows that are read.
  struct Part {
    std::uint64_t first, rows;
    std::uint64_t row;  ///< values
    const Conversion& conversion;
    std::uint8_t* to;
  };

  explicit Dataset(Object object) : object_(std::move(object)) {}
  void fill(const Part& part) const;
  Result<void> read_compact(const Part& part) const;
  Result<void> read_contiguous(const Part& part) const;
  Result<void> read_chunks(const Part& part) const;
  Result<void> read_chunk(const Chunk& chunk, const Shape& place, std::uint64_t size,
                          std::vector<std::uint8_t>& bytes) const;

  Object object_;
  Datatype type_;
  Space space_;
  Layout layout_;
  Filters filters_;
  std::vector<std::uint8_t> fill_;  ///< a stored value for places that were never written; none: zeros
};

}  // namespace symrig::tensor::h5
