// SPDX-License-Identifier: Apache-2.0

#include "symrig/camera/internal/frame_reader.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

namespace symrig::camera {
namespace {

unsigned at(const std::byte* bytes, std::size_t k) {
  return std::to_integer<unsigned>(bytes[k]);
}

std::uint16_t low_first(const std::byte* word) {
  if constexpr (std::endian::native == std::endian::little) {
    std::uint16_t value = 0;  // a single load lets the compiler vectorize the loop
    std::memcpy(&value, word, sizeof value);
    return value;
  }
  return static_cast<std::uint16_t>(at(word, 0) | at(word, 1) << 8);
}

std::uint16_t high_first(const std::byte* word) {
  return static_cast<std::uint16_t>(at(word, 0) << 8 | at(word, 1));
}

/// Reads word by word: word_at(k) returns word k.
template <class WordAt>
std::uint16_t unpack_words(SampleDepth depth, std::span<std::uint16_t> codes, WordAt word_at) {
  const auto most = static_cast<std::uint16_t>((1U << depth.bits) - 1);
  std::uint16_t seen = 0;
  for (std::size_t k = 0; k < codes.size(); ++k) {
    const std::uint16_t word = word_at(k);
    seen |= word;
    codes[k] = std::min(static_cast<std::uint16_t>(word >> depth.shift), most);
  }
  return seen;
}

/// Reads groups of Samples samples in Bytes bytes. split(bytes, words) unpacks one group.
template <std::size_t Samples, std::size_t Bytes, class Split>
std::uint16_t unpack_groups(const std::byte* row, SampleDepth depth, std::span<std::uint16_t> codes,
                            Split split) {
  std::uint16_t seen = 0;
  std::array<std::uint16_t, Samples> words{};
  for (std::size_t k = 0; k < codes.size(); k += Samples, row += Bytes) {
    split(row, words);
    const auto group = codes.subspan(k, std::min(Samples, codes.size() - k));
    seen |= unpack_words(depth, group, [&words](std::size_t j) { return words[j]; });
  }
  return seen;
}

using Two = std::array<std::uint16_t, 2>;
using Four = std::array<std::uint16_t, 4>;

void split_mipi10(const std::byte* bytes, Four& words) {
  for (std::size_t k = 0; k < 4; ++k)
    words[k] = static_cast<std::uint16_t>(at(bytes, k) << 2 | (at(bytes, 4) >> 2 * k & 3U));
}

void split_mipi12(const std::byte* bytes, Two& words) {
  for (std::size_t k = 0; k < 2; ++k)
    words[k] = static_cast<std::uint16_t>(at(bytes, k) << 4 | (at(bytes, 2) >> 4 * k & 15U));
}

void split_mipi14(const std::byte* bytes, Four& words) {
  const unsigned low = at(bytes, 4) | at(bytes, 5) << 8 | at(bytes, 6) << 16;
  for (std::size_t k = 0; k < 4; ++k)
    words[k] = static_cast<std::uint16_t>(at(bytes, k) << 6 | (low >> 6 * k & 63U));
}

void split_stream10(const std::byte* bytes, Four& words) {
  for (std::size_t k = 0; k < 4; ++k)  // sample k begins at bit 10 k, that is 2 k bits into byte k
    words[k] = static_cast<std::uint16_t>((at(bytes, k) << 8 | at(bytes, k + 1)) >> (6 - 2 * k) & 1023U);
}

void split_lowest10(const std::byte* bytes, Four& words) {
  for (std::size_t k = 0; k < 4; ++k)  // sample k begins at bit 10 k, that is 2 k bits into byte k
    words[k] = static_cast<std::uint16_t>((at(bytes, k) | at(bytes, k + 1) << 8) >> 2 * k & 1023U);
}

void split_lowest12(const std::byte* bytes, Two& words) {
  words[0] = static_cast<std::uint16_t>(at(bytes, 0) | (at(bytes, 1) & 15U) << 8);
  words[1] = static_cast<std::uint16_t>(at(bytes, 1) >> 4 | at(bytes, 2) << 4);
}

void split_gev10(const std::byte* bytes, Two& words) {
  words[0] = static_cast<std::uint16_t>(at(bytes, 0) << 2 | (at(bytes, 1) & 3U));
  words[1] = static_cast<std::uint16_t>(at(bytes, 2) << 2 | (at(bytes, 1) >> 4 & 3U));
}

void split_gev12(const std::byte* bytes, Two& words) {
  words[0] = static_cast<std::uint16_t>(at(bytes, 0) << 4 | (at(bytes, 1) & 15U));
  words[1] = static_cast<std::uint16_t>(at(bytes, 2) << 4 | at(bytes, 1) >> 4);
}

}  // namespace

int group_samples(Packing packing) {
  switch (packing) {
    case Packing::bytes:
    case Packing::words:
    case Packing::words_high_first:
      return 1;
    case Packing::mipi12:
    case Packing::lowest12:
    case Packing::gev10:
    case Packing::gev12:
    case Packing::luma_first:
    case Packing::luma_second:
      return 2;
    case Packing::mipi10:
    case Packing::mipi14:
    case Packing::stream10:
    case Packing::lowest10:
      return 4;
  }
  return 1;
}

std::uint16_t unpack(Packing packing, SampleDepth depth, std::span<const std::byte> row,
                     std::span<std::uint16_t> codes) {
  const std::byte* const bytes = row.data();
  switch (packing) {
    case Packing::bytes:
      return unpack_words(depth, codes,
                          [bytes](std::size_t k) { return std::to_integer<std::uint16_t>(bytes[k]); });
    case Packing::words:
      return unpack_words(depth, codes, [bytes](std::size_t k) { return low_first(bytes + 2 * k); });
    case Packing::words_high_first:
      return unpack_words(depth, codes, [bytes](std::size_t k) { return high_first(bytes + 2 * k); });
    case Packing::mipi10:
      return unpack_groups<4, 5>(bytes, depth, codes, split_mipi10);
    case Packing::mipi12:
      return unpack_groups<2, 3>(bytes, depth, codes, split_mipi12);
    case Packing::mipi14:
      return unpack_groups<4, 7>(bytes, depth, codes, split_mipi14);
    case Packing::stream10:
      return unpack_groups<4, 5>(bytes, depth, codes, split_stream10);
    case Packing::lowest10:
      return unpack_groups<4, 5>(bytes, depth, codes, split_lowest10);
    case Packing::lowest12:
      return unpack_groups<2, 3>(bytes, depth, codes, split_lowest12);
    case Packing::gev10:
      return unpack_groups<2, 3>(bytes, depth, codes, split_gev10);
    case Packing::gev12:
      return unpack_groups<2, 3>(bytes, depth, codes, split_gev12);
    case Packing::luma_first:
      return unpack_words(depth, codes,
                          [bytes](std::size_t k) { return std::to_integer<std::uint16_t>(bytes[2 * k]); });
    case Packing::luma_second:
      return unpack_words(
          depth, codes, [bytes](std::size_t k) { return std::to_integer<std::uint16_t>(bytes[2 * k + 1]); });
  }
  return 0;
}

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
