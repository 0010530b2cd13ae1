// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "camera/unpack.hpp"
#include "symrig/camera/pixel_format.hpp"
#include "symrig/camera/region.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace symrig::camera {

/// A picture's layout in the driver's memory.
struct PictureLayout {
  const PixelFormat* format = nullptr;
  SampleDepth depth;
  Grid size;
  std::size_t stride = 0;  ///< bytes from one row to the next, at least row_bytes()

  /// Bytes up to the end of the last row. Later bytes are ignored.
  std::size_t bytes() const {
    return stride * static_cast<std::size_t>(size.rows - 1) + row_bytes(*format, size.cols);
  }
};

/// Converts a driver's buffer into the binned codes of the region. Holds scratch rows: use one object per
/// thread.
class FrameReader {
 public:
  /// region: binned_grid() must accept it. saturation: a sample of this code or above sets its bin to the
  /// largest code. So no sum that contains a clipped sample looks like a measurement.
  FrameReader(const PictureLayout& layout, const Region& region, int saturation);

  Grid grid() const { return binned_.grid; }
  /// codes: grid().size() values, raster order. Rows that `data` does not hold in full become 0. Returns the
  /// OR of all words read.
  std::uint16_t read(std::span<const std::byte> data, std::span<std::uint16_t> codes);

 private:
  int rows_between() const;
  std::uint16_t read_row(std::span<const std::byte> data, int row, std::span<std::uint16_t> codes);
  std::uint16_t read_bins(std::span<const std::byte> data, int row, std::span<std::uint16_t> codes);
  void add(std::span<const std::uint16_t> samples);
  void store(std::span<std::uint16_t> codes) const;
  bool holds(std::span<const std::byte> data, int row) const;

  PictureLayout layout_;
  Region region_;
  BinnedGrid binned_;
  int saturation_, shift_;
  std::uint16_t largest_;
  std::vector<std::uint16_t> line_, row_;  // samples from the start of a group; samples of the region
  std::vector<std::uint32_t> sums_;
  std::vector<std::uint16_t> peaks_;
};

}  // namespace symrig::camera
