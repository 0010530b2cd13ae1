// SPDX-License-Identifier: Apache-2.0
#include "camera/frame_reader.hpp"

#include <algorithm>
#include <bit>

namespace symrig::camera {
namespace {

std::size_t count(int n) {
  return static_cast<std::size_t>(n);
}

/// The caller has already checked the region.
BinnedGrid grid_of(const PictureLayout& layout, const Region& region) {
  auto grid = binned_grid(layout.size, layout.format->mosaic, region);
  return grid ? *grid : BinnedGrid{};
}

}  // namespace

FrameReader::FrameReader(const PictureLayout& layout, const Region& region, int saturation)
    : layout_(layout),
      region_(resolved(layout.size, region)),
      binned_(grid_of(layout, region)),
      saturation_(saturation),
      shift_(binning_shift(layout.depth.bits, region.binning)) {
  const auto most =
      static_cast<std::uint32_t>(region.binning * region.binning) * ((1U << layout.depth.bits) - 1);
  largest_ = static_cast<std::uint16_t>((1U << (static_cast<int>(std::bit_width(most)) - shift_)) - 1);
  line_.resize(count(region_.col % group_samples(layout.format->packing) + region_.size.cols));
  row_.resize(count(region_.size.cols));
  sums_.resize(count(binned_.grid.cols));
  peaks_.resize(count(binned_.grid.cols));
}

/// Distance in rows between samples of one colour.
int FrameReader::rows_between() const {
  return binned_.mosaic == Mosaic::none ? 1 : 2;
}

bool FrameReader::holds(std::span<const std::byte> data, int row) const {
  return data.size() >= layout_.stride * count(row) + row_bytes(*layout_.format, layout_.size.cols);
}

std::uint16_t FrameReader::read_row(std::span<const std::byte> data, int row,
                                    std::span<std::uint16_t> codes) {
  if (!holds(data, row)) {
    std::fill(codes.begin(), codes.end(), std::uint16_t{0});
    return 0;
  }
  const Packing packing = layout_.format->packing;
  const int before = region_.col % group_samples(packing);
  const auto bytes =
      data.subspan(layout_.stride * count(row) + row_bytes(*layout_.format, region_.col - before));
  if (before == 0) return unpack(packing, layout_.depth, bytes, codes);
  const std::uint16_t seen = unpack(packing, layout_.depth, bytes, line_);
  std::copy_n(line_.begin() + before, codes.size(), codes.begin());
  return seen;
}

/// Adds one row of the region to the sums.
void FrameReader::add(std::span<const std::uint16_t> samples) {
  const std::size_t step = count(rows_between()), bin = count(region_.binning);
  for (std::size_t col = 0; col < sums_.size(); ++col) {
    const std::size_t first = col / step * step * bin + col % step;
    for (std::size_t k = 0; k < bin; ++k) {
      const std::uint16_t sample = samples[first + k * step];
      sums_[col] += sample;
      peaks_[col] = std::max(peaks_[col], sample);
    }
  }
}

void FrameReader::store(std::span<std::uint16_t> codes) const {
  const std::uint32_t half = shift_ == 0 ? 0 : 1U << (shift_ - 1);
  for (std::size_t col = 0; col < codes.size(); ++col) {
    const std::uint32_t sum = std::min<std::uint32_t>((sums_[col] + half) >> shift_, largest_);
    codes[col] = peaks_[col] >= saturation_ ? largest_ : static_cast<std::uint16_t>(sum);
  }
}

/// Reads one row of bins.
std::uint16_t FrameReader::read_bins(std::span<const std::byte> data, int row,
                                     std::span<std::uint16_t> codes) {
  std::fill(sums_.begin(), sums_.end(), 0U);
  std::fill(peaks_.begin(), peaks_.end(), std::uint16_t{0});
  const int step = rows_between();
  const int first = region_.row + row / step * step * region_.binning + row % step;
  std::uint16_t seen = 0;
  for (int k = 0; k < region_.binning; ++k) {
    seen |= read_row(data, first + k * step, row_);
    add(row_);
  }
  store(codes);
  return seen;
}

std::uint16_t FrameReader::read(std::span<const std::byte> data, std::span<std::uint16_t> codes) {
  std::uint16_t seen = 0;
  const std::size_t cols = count(binned_.grid.cols);
  for (int row = 0; row < binned_.grid.rows; ++row) {
    const auto out = codes.subspan(count(row) * cols, cols);
    seen |= region_.binning == 1 ? read_row(data, region_.row + row, out) : read_bins(data, row, out);
  }
  return seen;
}

}  // namespace symrig::camera
