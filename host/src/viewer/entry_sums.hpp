// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "viewer/page_tensor.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace symrig::viewer {

/// Collects single entries of T in any order, and adds up those of one place. In a symmetric tensor an entry
/// off the diagonal also stands for its mirror image, and the diagonal is kept apart.
class EntrySums {
 public:
  explicit EntrySums(PageTensor& page) : page_(page) {}

  /// T[row, col] += values[channel]; its mirror image too if row ≠ col and the tensor is symmetric.
  void add(std::int32_t row, std::int32_t col, std::span<const float> values);
  /// values: [entry * channels + channel].
  void add(std::span<const ScalarLeaf> at, std::span<const float> values);
  /// Sorts the entries into the page.
  void finish();

 private:
  struct Entry {
    std::int32_t row, col;
    std::array<float, 3> values;  // a tensor has at most 3 channels
  };
  void add_to_diagonal(std::int32_t pixel, std::span<const float> values);

  PageTensor& page_;
  std::vector<Entry> entries_;
};

}  // namespace symrig::viewer
