// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "tensor/h5_reader/datatype.hpp"
#include "tensor/h5_reader/file_bytes.hpp"
#include "tensor/h5_reader/object.hpp"

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

namespace symrig::tensor::h5 {

/// What was done to the chunks of a dataset, in order.
class Filters {
 public:
  Filters() = default;
  /// fails: bad_format (damaged, or with a filter that is not read here).
  static Result<Filters> parse(std::span<const std::uint8_t> message);

  bool any() const { return !filters_.empty(); }
  /// True if chunks can be much smaller than their values.
  bool compress() const;
  /// Undoes the filters on the stored bytes of a chunk of `size` bytes. skipped: bit k: not filter k.
  /// fails: bad_format.
  Result<void> undo(std::vector<std::uint8_t>& bytes, std::uint64_t size, std::uint32_t skipped) const;

 private:
  enum class Kind : std::uint16_t { deflate = 1, shuffle = 2, fletcher32 = 3 };
  struct Filter {
    Kind kind;
    std::uint32_t element = 0;  ///< bytes of a value, for shuffle
  };
  std::vector<Filter> filters_;
};

// Where the values of a dataset are.

struct Layout {
  enum class Kind : std::uint8_t { compact, contiguous, chunked };
  /// Which structure lists the chunks.
  enum class Index : std::uint8_t { old_tree, single, implicit, fixed_array, extensible_array, new_tree };

  Kind kind = Kind::contiguous;
  std::vector<std::uint8_t> values;  ///< compact
  Address at = kUndefined;           ///< of the values, or of the index
  std::uint64_t bytes = 0;           ///< contiguous
  Shape chunk;                       ///< in values
  Index index = Index::old_tree;
  bool plain_edges = false;        ///< chunks that reach over the edge have no filter
  std::uint64_t single_bytes = 0;  ///< index `single` with filters
  std::uint32_t single_skipped = 0;
};
/// fails: bad_format (damaged, in other files, or of a version that is not read here).
Result<Layout> parse_layout(const FileBytes& file, std::span<const std::uint8_t> message, const Space& space);

/// A chunk that is stored.
struct StoredChunk {
  std::uint64_t number = 0;  ///< row by row over the dataset's chunks
  Address at = kUndefined;
  std::uint64_t bytes = 0;
  std::uint32_t skipped = 0;  ///< filters
};

/// A dataset's chunks, numbered row by row.
class ChunkGrid {
 public:
  ChunkGrid(const Shape& size, const Shape& chunk);
  std::uint64_t all() const { return count(counts_); }
  std::uint64_t of_a_row() const { return of_a_row_; }  ///< chunks with the same rows
  /// Where the chunk begins, in chunks.
  Shape place(std::uint64_t number) const;
  /// Nothing outside: the largest number.
  std::uint64_t number(const Shape& place) const;

 private:
  Shape counts_;
  std::uint64_t of_a_row_ = 1;
};

/// The chunks with numbers [first, last) that are stored, by number.  fails: bad_format.
Result<std::vector<StoredChunk>> chunks_of(const FileBytes& file, const Layout& layout, const Space& space,
                                           std::uint64_t chunk_bytes, bool filtered, std::uint64_t first,
                                           std::uint64_t last);

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
  Result<void> read_chunk(const StoredChunk& chunk, const Shape& place, std::uint64_t size,
                          std::vector<std::uint8_t>& bytes) const;

  Object object_;
  Datatype type_;
  Space space_;
  Layout layout_;
  Filters filters_;
  std::vector<std::uint8_t> fill_;  ///< a stored value for places that were never written; none: zeros
};

}  // namespace symrig::tensor::h5
