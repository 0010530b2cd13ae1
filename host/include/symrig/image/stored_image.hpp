// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/paged_vector.hpp"
#include "symrig/image/image.hpp"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <span>
#include <utility>

namespace symrig {

/// An image that is kept for later. Its values may be in a scratch file (MemoryScope), so that many of them
/// take little memory. Planar, as Image.
class StoredImage {
 public:
  StoredImage() = default;
  StoredImage(
      const Image<float>& image)  // NOLINT(google-explicit-constructor): as if they were one type; a copy
      : grid_(image.grid()),
        channels_(image.channels()),
        values_(image.values().begin(), image.values().end()) {}
  operator Image<float>() const {  // NOLINT(google-explicit-constructor): the same
    Image<float> image(grid_, channels_);
    std::copy(values_.begin(), values_.end(), image.values().begin());
    return image;
  }

  Grid grid() const { return grid_; }
  int channels() const { return channels_; }
  std::span<float> values() { return values_; }
  std::span<const float> values() const { return values_; }
  std::span<const float> plane(int channel) const {
    assert(channel >= 0 && channel < channels_);
    const auto size = static_cast<std::size_t>(grid_.size());
    return values().subspan(static_cast<std::size_t>(channel) * size, size);
  }
  const float& at(int row, int col, int channel = 0) const {
    return plane(channel)[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid_.cols) +
                          static_cast<std::size_t>(col)];
  }
  float& at(int row, int col, int channel = 0) {
    const float& value = std::as_const(*this).at(row, col, channel);
    return values_[static_cast<std::size_t>(&value - values_.data())];
  }

  bool operator==(const StoredImage&) const = default;
  bool operator==(const Image<float>& other) const {
    return grid_ == other.grid() && channels_ == other.channels() &&
           std::ranges::equal(values(), other.values());
  }

 private:
  Grid grid_;
  int channels_ = 0;
  PagedVector<float> values_;
};

}  // namespace symrig
