// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/grid.hpp"

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace symrig {

/// Planar image: channels() planes of grid().size() values each, raster order inside a plane.
template <class T>
class Image {
 public:
  Image() = default;
  explicit Image(Grid grid, int channels = 1, T fill = T{})
      : grid_(grid),
        channels_(channels),
        data_(static_cast<std::size_t>(grid.size()) * static_cast<std::size_t>(channels), fill) {}

  Grid grid() const { return grid_; }
  int channels() const { return channels_; }
  bool empty() const { return data_.empty(); }

  /// All values of one channel, raster order, grid().size() of them.
  std::span<T> plane(int channel) {
    assert(channel >= 0 && channel < channels_);
    return std::span<T>(data_).subspan(plane_offset(channel), static_cast<std::size_t>(grid_.size()));
  }
  std::span<const T> plane(int channel) const {
    assert(channel >= 0 && channel < channels_);
    return std::span<const T>(data_).subspan(plane_offset(channel), static_cast<std::size_t>(grid_.size()));
  }
  /// All channels, plane after plane.
  std::span<T> values() { return data_; }
  std::span<const T> values() const { return data_; }

  T& at(int row, int col, int channel = 0) { return data_[index(row, col, channel)]; }
  const T& at(int row, int col, int channel = 0) const { return data_[index(row, col, channel)]; }

  bool operator==(const Image&) const = default;

 private:
  std::size_t plane_offset(int channel) const {
    return static_cast<std::size_t>(channel) * static_cast<std::size_t>(grid_.size());
  }
  std::size_t index(int row, int col, int channel) const {
    assert(row >= 0 && row < grid_.rows && col >= 0 && col < grid_.cols && channel >= 0 &&
           channel < channels_);
    return plane_offset(channel) + static_cast<std::size_t>(row) * static_cast<std::size_t>(grid_.cols) +
           static_cast<std::size_t>(col);
  }

  Grid grid_;
  int channels_ = 0;
  std::vector<T> data_;
};

/// What the projector shows: one channel (white light), values in [0, 1] on the projector grid.
using Pattern = Image<float>;

/// One photograph: radiance per unit of projector light, with its uncertainty.
/// mean, variance and valid have the same grid and channels. valid is 1 where the mean can be trusted, 0
/// where no sample is usable. Where valid is 0, mean and variance are 0: test valid, never guess from the
/// numbers. mean is signed, because black subtraction may give values below zero. Clipping them would bias
/// every sum.
struct Radiance {
  Image<float> mean;
  Image<float> variance;  ///< of mean, same units squared; 0 only where the measurement is noise-free
  Image<std::uint8_t> valid;
};

/// Scales a picture; each new pixel is the old pixel under its centre. Empty if either grid is empty.
Image<float> resize_nearest(const Image<float>& image, Grid grid);

/// Scales a picture; each new pixel is the mean of the old pixels under it, weighted by area. This keeps the
/// mean of the picture. Empty if either grid is empty.
Image<float> resize_box(const Image<float>& image, Grid grid);

/// Converts to one channel. RGB becomes linear luminance: 0.2126 R + 0.7152 G + 0.0722 B (Rec. 709). Any
/// other number of channels is averaged.
Image<float> to_gray(const Image<float>& image);

}  // namespace symrig
