// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "tensor/h5_reader/bytes.hpp"

#include <cstdint>
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

}  // namespace symrig::tensor::h5
