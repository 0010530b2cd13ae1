// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/camera/frame_format.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace symrig::camera {

/// Formats of GenICam cameras that symrig can read, by their PFNC codes and names [EMVA, Pixel Format Naming
/// Convention]. In the order of preference of pixel_formats().
std::span<const PixelFormat> genicam_formats();
/// nullptr: symrig cannot read it.
const PixelFormat* find_genicam_format(std::string_view name);

/// Where the sample lies in its word.
struct SampleDepth {
  int bits = 16;  ///< of a sample
  int shift = 0;  ///< unused bits below the sample
};

/// How many samples form a group in memory. Reading a row can start at a multiple of this number.
int group_samples(Packing packing);

/// Reads the first codes.size() samples of `row`, which has at least row_bytes() bytes: code = word >> shift,
/// at most 2^bits − 1. Returns the OR of all words. A bit outside the sample shows that the depth is wrong.
std::uint16_t unpack(Packing packing, SampleDepth depth, std::span<const std::byte> row,
                     std::span<std::uint16_t> codes);

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
