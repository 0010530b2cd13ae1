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

/// A picture as the driver lays it into memory.
struct PictureLayout {
  const PixelFormat* format = nullptr;
  SampleDepth depth;
  Grid size;
  std::size_t stride = 0;  ///< bytes from one row to the next, row_bytes() at least

  /// Bytes up to the end of the last row; what follows is of no interest.
  std::size_t bytes() const {
    return stride * static_cast<std::size_t>(size.rows - 1) + row_bytes(*format, size.cols);
  }
};

/// Turns a driver's buffer into the codes of the region, binned. Keeps scratch rows: one a thread.
class FrameReader {
 public:
  /// region: one that binned_grid() takes. saturation: a sample of this code or above makes its bin the
  /// largest code, so that no sum of clipped samples is taken for a measurement.
  FrameReader(const PictureLayout& layout, const Region& region, int saturation);

  Grid grid() const { return binned_.grid; }
  /// codes: grid().size() of them, raster order; 0 in rows that `data` does not hold whole. Returns all bits
  /// that any word had.
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
  std::vector<std::uint16_t> line_, row_;  // samples from a group's begin; of the region
  std::vector<std::uint32_t> sums_;
  std::vector<std::uint16_t> peaks_;
};

}  // namespace symrig::camera
