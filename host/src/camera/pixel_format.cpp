// SPDX-License-Identifier: Apache-2.0
#include "symrig/camera/pixel_format.hpp"

#include <algorithm>
#include <array>

#include <linux/videodev2.h>

namespace symrig {
namespace {

// The kernel headers of Debian 12 do not define it yet.
constexpr std::uint32_t kY012 = v4l2_fourcc('Y', '0', '1', '2');
constexpr std::uint32_t kY12P = v4l2_fourcc('Y', '1', '2', 'P');
constexpr std::uint32_t kY14P = v4l2_fourcc('Y', '1', '4', 'P');

constexpr Mosaic kRggb = Mosaic::rggb, kGrbg = Mosaic::grbg, kGbrg = Mosaic::gbrg, kBggr = Mosaic::bggr;
constexpr Mosaic kMono = Mosaic::none;

constexpr auto kFormats = std::to_array<PixelFormat>({
    {V4L2_PIX_FMT_Y16, "Y16", 16, Packing::words, kMono},
    {V4L2_PIX_FMT_Y16_BE, "Y16_BE", 16, Packing::words_high_first, kMono},
    {V4L2_PIX_FMT_SRGGB16, "SRGGB16", 16, Packing::words, kRggb},
    {V4L2_PIX_FMT_SGRBG16, "SGRBG16", 16, Packing::words, kGrbg},
    {V4L2_PIX_FMT_SGBRG16, "SGBRG16", 16, Packing::words, kGbrg},
    {V4L2_PIX_FMT_SBGGR16, "SBGGR16", 16, Packing::words, kBggr},
    {V4L2_PIX_FMT_Y14, "Y14", 14, Packing::words, kMono},
    {kY14P, "Y14P", 14, Packing::mipi14, kMono},
    {V4L2_PIX_FMT_SRGGB14, "SRGGB14", 14, Packing::words, kRggb},
    {V4L2_PIX_FMT_SGRBG14, "SGRBG14", 14, Packing::words, kGrbg},
    {V4L2_PIX_FMT_SGBRG14, "SGBRG14", 14, Packing::words, kGbrg},
    {V4L2_PIX_FMT_SBGGR14, "SBGGR14", 14, Packing::words, kBggr},
    {V4L2_PIX_FMT_SRGGB14P, "SRGGB14P", 14, Packing::mipi14, kRggb},
    {V4L2_PIX_FMT_SGRBG14P, "SGRBG14P", 14, Packing::mipi14, kGrbg},
    {V4L2_PIX_FMT_SGBRG14P, "SGBRG14P", 14, Packing::mipi14, kGbrg},
    {V4L2_PIX_FMT_SBGGR14P, "SBGGR14P", 14, Packing::mipi14, kBggr},
    {V4L2_PIX_FMT_Y12, "Y12", 12, Packing::words, kMono},
    {kY012, "Y012", 12, Packing::words, kMono, 4},
    {kY12P, "Y12P", 12, Packing::mipi12, kMono},
    {V4L2_PIX_FMT_SRGGB12, "SRGGB12", 12, Packing::words, kRggb},
    {V4L2_PIX_FMT_SGRBG12, "SGRBG12", 12, Packing::words, kGrbg},
    {V4L2_PIX_FMT_SGBRG12, "SGBRG12", 12, Packing::words, kGbrg},
    {V4L2_PIX_FMT_SBGGR12, "SBGGR12", 12, Packing::words, kBggr},
    {V4L2_PIX_FMT_SRGGB12P, "SRGGB12P", 12, Packing::mipi12, kRggb},
    {V4L2_PIX_FMT_SGRBG12P, "SGRBG12P", 12, Packing::mipi12, kGrbg},
    {V4L2_PIX_FMT_SGBRG12P, "SGBRG12P", 12, Packing::mipi12, kGbrg},
    {V4L2_PIX_FMT_SBGGR12P, "SBGGR12P", 12, Packing::mipi12, kBggr},
    {V4L2_PIX_FMT_Y10, "Y10", 10, Packing::words, kMono},
    {V4L2_PIX_FMT_Y10P, "Y10P", 10, Packing::mipi10, kMono},
    {V4L2_PIX_FMT_Y10BPACK, "Y10BPACK", 10, Packing::stream10, kMono},
    {V4L2_PIX_FMT_SRGGB10, "SRGGB10", 10, Packing::words, kRggb},
    {V4L2_PIX_FMT_SGRBG10, "SGRBG10", 10, Packing::words, kGrbg},
    {V4L2_PIX_FMT_SGBRG10, "SGBRG10", 10, Packing::words, kGbrg},
    {V4L2_PIX_FMT_SBGGR10, "SBGGR10", 10, Packing::words, kBggr},
    {V4L2_PIX_FMT_SRGGB10P, "SRGGB10P", 10, Packing::mipi10, kRggb},
    {V4L2_PIX_FMT_SGRBG10P, "SGRBG10P", 10, Packing::mipi10, kGrbg},
    {V4L2_PIX_FMT_SGBRG10P, "SGBRG10P", 10, Packing::mipi10, kGbrg},
    {V4L2_PIX_FMT_SBGGR10P, "SBGGR10P", 10, Packing::mipi10, kBggr},
    {V4L2_PIX_FMT_GREY, "GREY", 8, Packing::bytes, kMono},
    {V4L2_PIX_FMT_SRGGB8, "SRGGB8", 8, Packing::bytes, kRggb},
    {V4L2_PIX_FMT_SGRBG8, "SGRBG8", 8, Packing::bytes, kGrbg},
    {V4L2_PIX_FMT_SGBRG8, "SGBRG8", 8, Packing::bytes, kGbrg},
    {V4L2_PIX_FMT_SBGGR8, "SBGGR8", 8, Packing::bytes, kBggr},
});

// Luma of a colour picture: last, and only used if the settings name it.
constexpr auto kLuma = std::to_array<PixelFormat>({
    {V4L2_PIX_FMT_YUYV, "YUYV", 8, Packing::luma_first, kMono, 0, false},
    {V4L2_PIX_FMT_YVYU, "YVYU", 8, Packing::luma_first, kMono, 0, false},
    {V4L2_PIX_FMT_UYVY, "UYVY", 8, Packing::luma_second, kMono, 0, false},
    {V4L2_PIX_FMT_VYUY, "VYUY", 8, Packing::luma_second, kMono, 0, false},
});

constexpr auto kAll = [] {
  std::array<PixelFormat, kFormats.size() + kLuma.size()> all{};
  std::copy(kFormats.begin(), kFormats.end(), all.begin());
  std::copy(kLuma.begin(), kLuma.end(), all.begin() + kFormats.size());
  return all;
}();

template <class Fits>
const PixelFormat* find(Fits fits) {
  const auto* const found = std::find_if(kAll.begin(), kAll.end(), fits);
  return found == kAll.end() ? nullptr : found;
}

/// `bytes` for each group of `samples`. The last group counts in full.
std::size_t groups(int cols, std::size_t samples, std::size_t bytes) {
  return (static_cast<std::size_t>(cols) + samples - 1) / samples * bytes;
}

constexpr std::uint32_t kBigEndian = 1U << 31;

}  // namespace

std::span<const PixelFormat> pixel_formats() {
  return kAll;
}

const PixelFormat* find_pixel_format(std::uint32_t fourcc) {
  return find([fourcc](const PixelFormat& format) { return format.fourcc == fourcc; });
}

const PixelFormat* find_pixel_format(std::string_view name) {
  return find([name](const PixelFormat& format) {
    return format.name == name || fourcc_text(format.fourcc) == name;
  });
}

std::string fourcc_text(std::uint32_t fourcc) {
  std::string text;
  for (unsigned k = 0; k < 4; ++k) {
    const auto c = static_cast<unsigned char>((fourcc & ~kBigEndian) >> (8 * k));
    text += c >= 0x20 && c < 0x7F ? static_cast<char>(c) : '?';
  }
  text.erase(text.find_last_not_of(' ') + 1);
  return (fourcc & kBigEndian) != 0 ? text + "-BE" : text;
}

std::size_t row_bytes(const PixelFormat& format, int cols) {
  switch (format.packing) {
    case Packing::bytes:
      return groups(cols, 1, 1);
    case Packing::words:
    case Packing::words_high_first:
      return groups(cols, 1, 2);
    case Packing::mipi10:
    case Packing::stream10:
    case Packing::lowest10:
      return groups(cols, 4, 5);
    case Packing::mipi12:
    case Packing::lowest12:
    case Packing::gev10:
    case Packing::gev12:
      return groups(cols, 2, 3);
    case Packing::mipi14:
      return groups(cols, 4, 7);
    case Packing::luma_first:
    case Packing::luma_second:
      return groups(cols, 2, 4);
  }
  return 0;
}

}  // namespace symrig
