// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/hdr/mosaic.hpp"
#include "symrig/hdr/noise_model.hpp"
#include "symrig/image/grid.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace symrig {

/// The colour filters of a sensor: the first two pixels of its top row, then the first two of the second row.
/// none: the sensor has no colour filters.
enum class Mosaic : std::uint8_t { none, rggb, grbg, gbrg, bggr };

/// The mosaic of the sensor's region that begins at pixel (rows, cols).
constexpr Mosaic shifted(Mosaic mosaic, int rows, int cols) {
  if (mosaic == Mosaic::none) return mosaic;
  // In the order of the enumeration, one more column swaps 0↔1 and 2↔3. One more row swaps 0↔2 and 1↔3.
  const int index = (static_cast<int>(mosaic) - 1) ^ (cols & 1) ^ (2 * (rows & 1));
  return static_cast<Mosaic>(index + 1);
}

/// Which colour each pixel sees. mosaic: not none.
constexpr BayerPattern filters(Mosaic mosaic) {
  const int index = static_cast<int>(mosaic) - 1;  // as in shifted()
  const BayerPattern rggb;
  const auto seen = [&](int row, int col) { return rggb.at(row + index / 2, col + index % 2); };
  return {{seen(0, 0), seen(0, 1), seen(1, 0), seen(1, 1)}};
}

/// "none", "rggb", "grbg", "gbrg", "bggr".
constexpr std::string_view name(Mosaic mosaic) {
  constexpr std::array<std::string_view, 5> names{"none", "rggb", "grbg", "gbrg", "bggr"};
  return names.at(static_cast<std::size_t>(mosaic));
}

/// How the samples of one row are stored in memory [Linux media, userspace-api/media/v4l/pixfmt].
enum class Packing : std::uint8_t {
  bytes,             ///< one byte per sample
  words,             ///< two bytes per sample, little-endian
  words_high_first,  ///< two bytes per sample, big-endian
  mipi10,            ///< 4 samples in 5 bytes: four high bytes, then 4 × 2 low bits, the first sample lowest
  mipi12,            ///< 2 samples in 3 bytes: two high bytes, then 2 × 4 low bits, the first sample lowest
  mipi14,            ///< 4 samples in 7 bytes: four high bytes, then 4 × 6 low bits, the first sample lowest
  stream10,          ///< 4 samples in 5 bytes as one bit stream, the highest bit first
  lowest10,          ///< 4 samples in 5 bytes as one bit stream, the lowest bit first [PFNC, "10p"]
  lowest12,          ///< 2 samples in 3 bytes as one bit stream, the lowest bit first [PFNC, "12p"]
  gev10,       ///< 2 samples in 3 bytes: high byte, 2 + 2 low bits in a byte, high byte [PFNC, "10Packed"]
  gev12,       ///< 2 samples in 3 bytes: high byte, 4 + 4 low bits, high byte [PFNC, "12Packed"]
  luma_first,  ///< 4:2:2, luma in the even bytes
  luma_second  ///< 4:2:2, luma in the odd bytes
};

/// A pixel format that symrig can read: one sample per pixel, of `bits` bits.
struct PixelFormat {
  std::uint32_t fourcc = 0;  ///< of V4L2; with GenICam cameras the format's PFNC code
  std::string_view name;     ///< V4L2_PIX_FMT_<name>; with GenICam cameras the PFNC name
  int bits = 8;
  Packing packing = Packing::bytes;
  Mosaic mosaic = Mosaic::none;
  int shift = 0;       ///< unused bits below the sample in its word
  bool linear = true;  ///< false: codes are not proportional to light (gamma)
};

/// All readable formats, in order of preference: linear before nonlinear, more bits before fewer, monochrome
/// before mosaic, words before packed samples.
std::span<const PixelFormat> pixel_formats();
/// nullptr: not a readable format.
const PixelFormat* find_pixel_format(std::uint32_t fourcc);
/// Finds a format by V4L2's name ("SRGGB10") or by FourCC ("RG10"). Case matters. nullptr: none.
const PixelFormat* find_pixel_format(std::string_view name);

/// "Y10", "RG10", "Y16-BE": the four characters without trailing blanks. "-BE" stands for V4L2's big-endian
/// flag. Unprintable characters become '?'.
std::string fourcc_text(std::uint32_t fourcc);

/// Bytes of a row of `cols` samples. Samples that are packed in groups take whole groups.
std::size_t row_bytes(const PixelFormat& format, int cols);

/// The part of a camera's picture that is kept, and its binning.
struct Region {
  int row = 0, col = 0;  ///< corner in the picture
  Grid size;             ///< {0, 0}: from the corner to the opposite end of the picture
  int binning = 1;       ///< sums binning × binning samples of one colour

  bool operator==(const Region&) const = default;
};

/// The grid after binning, and its colours. A mosaic stays a mosaic: samples of one colour are two pixels
/// apart, so a square of 2·binning pixels becomes 2 × 2 sums.
struct BinnedGrid {
  Grid grid;
  Mosaic mosaic = Mosaic::none;
};

/// picture: the size of the driver's picture.
/// fails: bad_argument (outside the picture, or not a whole number of squares; the hint gives the largest
/// region that fits).
Result<BinnedGrid> binned_grid(Grid picture, Mosaic mosaic, const Region& region);

/// The region with its real size instead of {0, 0}.
Region resolved(Grid picture, Region region);

/// How many bits the sum of n = binning² samples of `bits` bits is shifted right to fit into 16 bits.
int binning_shift(int bits, int binning);

/// The noise model of the binned codes: code = (Σ of n samples) / 2^s, rounded, with s = binning_shift().
///   gain' = gain / 2^s,  pedestal' = n pedestal / 2^s,  full well' = (2^bits' − 1 − pedestal') / gain'
///   Var'[code] = n Var[code] / 4^s + (1 − 4^−s) / 12            the last term: s bits rounded off
/// noise must be valid(). A bin with a saturated sample gets the largest code; FrameReader does this.
NoiseModel binned(const NoiseModel& noise, int binning);

}  // namespace symrig
