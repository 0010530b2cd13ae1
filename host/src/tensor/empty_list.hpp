// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/tensor/transport_tensor.hpp"

#include <cstdint>
#include <vector>

namespace symrig::tensor {

/// The empty leaves of one level, sorted by row block, then column block. Each is stored as the distance from
/// the previous one in as few bytes as possible: 7 bits a byte, lowest first; the eighth bit means "more
/// bytes follow".
class EmptyList {
 public:
  EmptyList() = default;
  /// columns: column blocks of the level.
  EmptyList(std::vector<EmptyLeaf> leaves, std::int64_t columns);

  std::int64_t size() const { return size_; }
  std::vector<EmptyLeaf> leaves() const;
  std::int64_t bytes() const { return static_cast<std::int64_t>(steps_.size()); }

 private:
  std::int64_t size_ = 0, columns_ = 1;
  std::vector<std::uint8_t> steps_;
};

}  // namespace symrig::tensor
