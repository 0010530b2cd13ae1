// SPDX-License-Identifier: Apache-2.0
// Where the values of a dataset are.
#pragma once

#include "tensor/h5_reader/datatype.hpp"
#include "tensor/h5_reader/object_header.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace symrig::tensor::h5 {

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
struct Chunk {
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
Result<std::vector<Chunk>> chunks_of(const FileBytes& file, const Layout& layout, const Space& space,
                                     std::uint64_t chunk_bytes, bool filtered, std::uint64_t first,
                                     std::uint64_t last);

}  // namespace symrig::tensor::h5
