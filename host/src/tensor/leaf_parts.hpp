// SPDX-License-Identifier: Apache-2.0
// The low-rank leaves of a tensor in parts, in memory or in their file.
#pragma once

#include "symrig/base/paged_vector.hpp"
#include "symrig/base/result.hpp"
#include "symrig/tensor/transport_tensor.hpp"
#include "tensor/low_rank.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace symrig::tensor {

/// Leaves that are kept, read and applied together: numbers [first, last) of a tensor's leaves. Their values
/// and columns are consecutive in `leaves/factors` and `leaves/exponents` of a scene file.
struct PartRange {
  std::size_t first = 0, last = 0;
  std::size_t first_value = 0, values = 0;    ///< of all channels
  std::size_t first_column = 0, columns = 0;  ///< of all channels, both sides

  /// False if the part is full. A leaf that is longer than a part is a part of its own.
  bool add(const Leaf& leaf, int channels);
  /// The part behind this one, still empty.
  PartRange next() const { return {last, last, first_value + values, 0, first_column + columns, 0}; }
};

/// Most values of a part: 32 MB of halves, large enough to be read at the speed of a disk. A longer leaf is a
/// part of its own.
std::size_t part_values();

/// For tests: parts of fewer values, as long as this lives. Tensors of before are of no use meanwhile.
class SmallParts {
 public:
  explicit SmallParts(std::size_t values);
  SmallParts(const SmallParts&) = delete;
  SmallParts& operator=(const SmallParts&) = delete;
  ~SmallParts();
};

/// Cuts leaves into parts. A function of the leaves alone: sums over parts then have the same bits, wherever
/// the parts are kept. At least one part, which may have no leaves.
std::vector<PartRange> parts_of(std::span<const Leaf> leaves, int channels);

/// Reads the values of a part into memory that is used again. leaves: those of the part. Several threads may
/// call it.  fails: io, bad_format, bad_value.
using ReadPart =
    std::function<Result<void>(const PartRange& part, std::span<const Leaf> leaves, PartValues& to)>;

/// The low-rank leaves. Parts that are not in memory are read each time that they are needed, the next one
/// while one is used.
class LeafParts {
 public:
  LeafParts() = default;
  /// In memory. factors: as LowRank takes them.
  LeafParts(std::span<const Leaf> leaves, std::span<const float> factors, const LowRank::Shape& shape);
  /// Read each time.
  LeafParts(std::span<const Leaf> leaves, ReadPart read, const LowRank::Shape& shape);
  /// Read now, and kept in memory.  fails: as `read`.
  static Result<LeafParts> kept(std::span<const Leaf> leaves, const ReadPart& read,
                                const LowRank::Shape& shape);

  std::size_t size() const { return ranges_.size(); }
  bool in_memory() const { return read_ == nullptr; }
  /// The only part of a tensor in memory that has one; otherwise none.
  const LowRank* only() const { return size() == 1 && in_memory() ? kept_.data() : nullptr; }

  /// Calls use(part) for each part in order. Another thread reads the next one meanwhile.
  /// leaves: the leaves that the parts were made of.  fails: as ReadPart.
  using Use = std::function<void(const LowRank& part)>;
  Result<void> visit(std::span<const Leaf> leaves, const Use& use) const;
  /// Calls use(leaf, factors) for each leaf, factors: as TensorBuilder::add_leaf takes them. The calling
  /// thread reads the parts.
  using UseFactors = std::function<void(const Leaf& leaf, std::span<const float> factors)>;
  Result<void> visit_factors(std::span<const Leaf> leaves, const UseFactors& use) const;

  /// Of the factors and their index; those in a file have no index.
  std::int64_t bytes() const;

 private:
  friend class LeafPacking;
  std::span<const Leaf> leaves_of(std::span<const Leaf> leaves, std::size_t part) const {
    return leaves.subspan(ranges_[part].first, ranges_[part].last - ranges_[part].first);
  }
  /// A part and the memory that it was read into. Both are used again: new memory would cost more time than
  /// to read.
  struct Place {
    PartValues values;
    LowRank part;
  };
  Result<void> read(std::span<const Leaf> leaves, std::size_t part, Place& to) const;

  LowRank::Shape shape_{};
  std::vector<PartRange> ranges_;
  std::vector<LowRank> kept_;  // all, or none
  ReadPart read_;              // of parts that are not kept
};

/// Makes parts of leaves as they come, so that only one part is held as floats. The parts are those of
/// parts_of().
class LeafPacking {
 public:
  explicit LeafPacking(const LowRank::Shape& shape) { parts_.shape_ = shape; }

  void add(const Leaf& leaf, std::span<const float> factors);
  LeafParts finish() &&;

 private:
  void pack();

  LeafParts parts_;
  PartRange range_;
  std::vector<Leaf> leaves_;  // of the part that is being filled
  PagedVector<float> factors_;
};

}  // namespace symrig::tensor
