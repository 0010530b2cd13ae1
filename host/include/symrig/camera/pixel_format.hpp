// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/camera/mosaic.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace symrig {

/// How the samples of one row lie in memory [Linux media, userspace-api/media/v4l/pixfmt].
enum class Packing : std::uint8_t {
  bytes,             ///< a byte a sample
  words,             ///< two bytes a sample, the low one first
  words_high_first,  ///< two bytes a sample, the high one first
  mipi10,            ///< 4 samples in 5 bytes: four high bytes, then four times 2 low bits, the first lowest
  mipi12,            ///< 2 samples in 3 bytes: two high bytes, then twice 4 low bits, the first lowest
  mipi14,            ///< 4 samples in 7 bytes: four high bytes, then four times 6 low bits, the first lowest
  stream10,          ///< 4 samples in 5 bytes as one stream of bits, the highest first
  luma_first,        ///< 4:2:2, the luma in the even bytes
  luma_second        ///< 4:2:2, the luma in the odd bytes
};

/// A pixel format of V4L2 that is read here: one sample a pixel, of `bits` bits.
struct PixelFormat {
  std::uint32_t fourcc = 0;
  std::string_view name;  ///< V4L2_PIX_FMT_<name>
  int bits = 8;
  Packing packing = Packing::bytes;
  Mosaic mosaic = Mosaic::none;
  int shift = 0;       ///< bits below the sample in its word
  bool linear = true;  ///< false: a picture for people; codes are no measure of light
};

/// All that are read, the preferred ones first: linear before not linear, deep before shallow, one colour
/// before a mosaic, samples in words before packed ones.
std::span<const PixelFormat> pixel_formats();
/// nullptr: not one of them.
const PixelFormat* find_pixel_format(std::uint32_t fourcc);
/// By V4L2's name ("SRGGB10") or by FourCC ("RG10"), upper and lower case as there. nullptr: none.
const PixelFormat* find_pixel_format(std::string_view name);

/// "Y10", "RG10", "Y16-BE": the four characters without blanks at the end, "-BE" for V4L2's big-endian mark;
/// what is no printable character becomes '?'.
std::string fourcc_text(std::uint32_t fourcc);

/// Bytes that a row of `cols` samples takes; whole groups where samples are packed in groups.
std::size_t row_bytes(const PixelFormat& format, int cols);

}  // namespace symrig
