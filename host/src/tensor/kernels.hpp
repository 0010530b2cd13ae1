// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::tensor {

/// Where a vector in tree order is not zero, so that a leaf whose lit side is dark is skipped without reading
/// its factors.
class LitRanges {
 public:
  explicit LitRanges(std::span<const float> values);
  /// Any non-zero value in [begin, end)?
  bool any(std::int32_t begin, std::int32_t end) const {
    return before_[static_cast<std::size_t>(end)] != before_[static_cast<std::size_t>(begin)];
  }

 private:
  std::vector<std::int32_t> before_;  // number of non-zero values before each index
};

/// out += A (Bᵀ lit).  A [rows × rank], B [cols × rank], column-major.  rows = out.size(), cols = lit.size().
/// No allocation. Spans do not overlap.
void add_low_rank(const float* a, const float* b, int rank, std::span<const float> lit,
                  std::span<float> out) noexcept;

/// Σ aᵢ bᵢ in eight fixed partial sums: the same bits on every machine of one floating-point behaviour.
float dot(std::span<const float> a, std::span<const float> b) noexcept;

}  // namespace symrig::tensor
