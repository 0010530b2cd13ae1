// SPDX-License-Identifier: Apache-2.0

#include "symrig/camera/frame_format.hpp"

#include "symrig/camera/internal/frame_reader.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include <fmt/format.h>
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

namespace symrig::camera {
namespace {

using enum Mosaic;
using enum Packing;

constexpr auto kPfnc = std::to_array<PixelFormat>({
    {0x01100007, "Mono16", 16, words, none},
    {0x0110002F, "BayerRG16", 16, words, rggb},
    {0x0110002E, "BayerGR16", 16, words, grbg},
    {0x01100030, "BayerGB16", 16, words, gbrg},
    {0x01100031, "BayerBG16", 16, words, bggr},
    {0x01100025, "Mono14", 14, words, none},
    {0x01100005, "Mono12", 12, words, none},
    {0x010C0047, "Mono12p", 12, lowest12, none},
    {0x010C0006, "Mono12Packed", 12, gev12, none},
    {0x01100011, "BayerRG12", 12, words, rggb},
    {0x01100010, "BayerGR12", 12, words, grbg},
    {0x01100012, "BayerGB12", 12, words, gbrg},
    {0x01100013, "BayerBG12", 12, words, bggr},
    {0x010C0059, "BayerRG12p", 12, lowest12, rggb},
    {0x010C0057, "BayerGR12p", 12, lowest12, grbg},
    {0x010C0055, "BayerGB12p", 12, lowest12, gbrg},
    {0x010C0053, "BayerBG12p", 12, lowest12, bggr},
    {0x010C002B, "BayerRG12Packed", 12, gev12, rggb},
    {0x010C002A, "BayerGR12Packed", 12, gev12, grbg},
    {0x010C002C, "BayerGB12Packed", 12, gev12, gbrg},
    {0x010C002D, "BayerBG12Packed", 12, gev12, bggr},
    {0x01100003, "Mono10", 10, words, none},
    {0x010A0046, "Mono10p", 10, lowest10, none},
    {0x010C0004, "Mono10Packed", 10, gev10, none},
    {0x0110000D, "BayerRG10", 10, words, rggb},
    {0x0110000C, "BayerGR10", 10, words, grbg},
    {0x0110000E, "BayerGB10", 10, words, gbrg},
    {0x0110000F, "BayerBG10", 10, words, bggr},
    {0x010A0058, "BayerRG10p", 10, lowest10, rggb},
    {0x010A0056, "BayerGR10p", 10, lowest10, grbg},
    {0x010A0054, "BayerGB10p", 10, lowest10, gbrg},
    {0x010A0052, "BayerBG10p", 10, lowest10, bggr},
    {0x010C0027, "BayerRG10Packed", 10, gev10, rggb},
    {0x010C0026, "BayerGR10Packed", 10, gev10, grbg},
    {0x010C0028, "BayerGB10Packed", 10, gev10, gbrg},
    {0x010C0029, "BayerBG10Packed", 10, gev10, bggr},
    {0x01080001, "Mono8", 8, bytes, none},
    {0x01080009, "BayerRG8", 8, bytes, rggb},
    {0x01080008, "BayerGR8", 8, bytes, grbg},
    {0x0108000A, "BayerGB8", 8, bytes, gbrg},
    {0x0108000B, "BayerBG8", 8, bytes, bggr},
});

}  // namespace

std::span<const PixelFormat> genicam_formats() {
  return kPfnc;
}

const PixelFormat* find_genicam_format(std::string_view name) {
  const auto* const found = std::ranges::find(kPfnc, name, &PixelFormat::name);
  return found == kPfnc.end() ? nullptr : found;
}

}  // namespace symrig::camera

namespace symrig {
namespace {

std::uint32_t largest_sum(int bits, int binning) {
  return static_cast<std::uint32_t>(binning * binning) * ((1U << bits) - 1);
}

std::string text(const Region& region) {
  return fmt::format("{} from row {}, column {}", to_string(region.size), region.row, region.col);
}

/// region: resolved(), with its real size.
Result<BinnedGrid> binned_grid_of(Grid picture, Mosaic mosaic, const Region& region) {
  if (region.binning < 1 || region.binning > 64)
    return Error{ErrorCode::bad_argument, fmt::format("binning {} is out of range", region.binning),
                 "1 to 64"};
  const bool inside = region.row >= 0 && region.col >= 0 && region.size.valid() &&
                      region.size.rows <= picture.rows - region.row &&
                      region.size.cols <= picture.cols - region.col;
  if (!inside)
    return Error{
        ErrorCode::bad_argument,
        fmt::format("the region {} is not inside the picture of {}", text(region), to_string(picture)),
        "give sizes as rows x columns"};
  const int square = mosaic == Mosaic::none ? region.binning : region.binning == 1 ? 1 : 2 * region.binning;
  const Grid whole{region.size.rows / square * square, region.size.cols / square * square};
  if (whole != region.size || !whole.valid())
    return Error{
        ErrorCode::bad_argument,
        fmt::format("the region {} is not a whole number of squares of {} pixels, as binning {} needs{}",
                    text(region), square, region.binning, mosaic == Mosaic::none ? "" : " on a mosaic"),
        whole.valid() ? "the next smaller region is " + to_string(whole)
                      : "take a larger region or a smaller binning"};
  return BinnedGrid{{region.size.rows / region.binning, region.size.cols / region.binning},
                    shifted(mosaic, region.row, region.col)};
}

}  // namespace

Region resolved(Grid picture, Region region) {
  if (region.size == Grid{} && region.row >= 0 && region.col >= 0)
    region.size = {picture.rows - region.row, picture.cols - region.col};
  return region;
}

Result<BinnedGrid> binned_grid(Grid picture, Mosaic mosaic, const Region& region) {
  return binned_grid_of(picture, mosaic, resolved(picture, region));
}

int binning_shift(int bits, int binning) {
  return std::max(0, static_cast<int>(std::bit_width(largest_sum(bits, binning))) - 16);
}

NoiseModel binned(const NoiseModel& noise, int binning) {
  const int shift = binning_shift(noise.bits(), binning);
  const double n = binning * binning;
  const double scale = std::ldexp(1.0, -shift);
  const double offset = noise.gain() * noise.gain() * noise.floor_variance();
  return NoiseModel::from_variance_line({
      .offset = n * offset * scale * scale + (1 - scale * scale) / 12,
      .slope = noise.gain() * scale,
      .bits = static_cast<int>(std::bit_width(largest_sum(noise.bits(), binning))) - shift,
      .pedestal = n * noise.pedestal() * scale,
  });
}

}  // namespace symrig
