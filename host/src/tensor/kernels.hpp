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

/// Σ aᵢ bᵢ over n values, in as many partial sums as the machine has vector lanes: the same bits for any
/// number of threads, not for any instruction set.  error: ≤ n ε Σ|aᵢ bᵢ|.
float dot(const float* a, const float* b, std::size_t n);

/// y += w a over n values.
void add_scaled(float w, const float* a, float* y, std::size_t n);

/// y += w a, and returns Σ aᵢ pᵢ: one pass over a serves both halves of a symmetric leaf.
float add_scaled_and_dot(float w, const float* a, const float* p, float* y, std::size_t n);

}  // namespace symrig::tensor
