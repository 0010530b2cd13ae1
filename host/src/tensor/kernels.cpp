// SPDX-License-Identifier: Apache-2.0
#include "tensor/kernels.hpp"

#include <array>
#include <cstddef>

namespace symrig::tensor {

LitRanges::LitRanges(std::span<const float> values) : before_(values.size() + 1) {
  std::int32_t count = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    before_[i] = count;
    count += values[i] != 0.0F ? 1 : 0;
  }
  before_[values.size()] = count;
}

float dot(std::span<const float> a, std::span<const float> b) noexcept {
  constexpr std::size_t kLanes = 16;
  std::array<float, kLanes> sums{};
  const std::size_t whole = a.size() - a.size() % kLanes;
  for (std::size_t i = 0; i < whole; i += kLanes)
    for (std::size_t lane = 0; lane < kLanes; ++lane) sums[lane] += a[i + lane] * b[i + lane];
  for (std::size_t i = whole; i < a.size(); ++i) sums[i - whole] += a[i] * b[i];
  for (std::size_t half = kLanes / 2; half > 0; half /= 2)
    for (std::size_t lane = 0; lane < half; ++lane) sums[lane] += sums[lane + half];
  return sums[0];
}

void add_low_rank(const float* a, const float* b, int rank, std::span<const float> lit,
                  std::span<float> out) noexcept {
  const std::size_t rows = out.size();
  const std::size_t cols = lit.size();
  for (int k = 0; k < rank; ++k, a += rows, b += cols) {
    const float weight = dot(std::span(b, cols), lit);
    if (weight == 0.0F) continue;
    float* const y = out.data();
    for (std::size_t i = 0; i < rows; ++i) y[i] += weight * a[i];
  }
}

}  // namespace symrig::tensor
