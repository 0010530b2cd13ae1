// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/camera/mosaic.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace symrig {

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

}  // namespace symrig
