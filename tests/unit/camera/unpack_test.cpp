// SPDX-License-Identifier: Apache-2.0
// Every pixel format against a slow reference that reads single bits, where [Linux media, pixfmt] puts them.
#include "symrig/camera/frame_format.hpp"
#include "symrig/camera/internal/frame_reader.hpp"

#include <array>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::unpack_test {
namespace {

using camera::unpack;
using Bytes = std::vector<std::byte>;

/// Where bit `bit` (0 = lowest) of sample `k` of a row stands: byte, and bit in it.
using Place = std::pair<std::size_t, unsigned>;

Place mipi_place(std::size_t k, unsigned bit, std::size_t samples, unsigned bits, std::size_t bytes) {
  const std::size_t group = k / samples * bytes, j = k % samples;
  const unsigned low = bits - 8;
  if (bit >= low) return {group + j, bit - low};
  const std::size_t stream = j * low + bit;  // the low bits as one number, the first sample's lowest
  return {group + samples + stream / 8, static_cast<unsigned>(stream % 8)};
}

/// 2 samples in 3 bytes: the outer bytes are the high ones, the halves of the middle one the low bits.
Place gev_place(std::size_t k, unsigned bit, unsigned low) {
  const std::size_t group = k / 2 * 3, j = k % 2;
  if (bit >= low) return {group + 2 * j, bit - low};
  return {group + 1, bit + 4 * static_cast<unsigned>(j)};
}

Place place(Packing packing, std::size_t k, unsigned bit) {
  switch (packing) {
    case Packing::bytes:
      return {k, bit};
    case Packing::words:
      return {2 * k + bit / 8, bit % 8};
    case Packing::words_high_first:
      return {2 * k + 1 - bit / 8, bit % 8};
    case Packing::mipi10:
      return mipi_place(k, bit, 4, 10, 5);
    case Packing::mipi12:
      return mipi_place(k, bit, 2, 12, 3);
    case Packing::mipi14:
      return mipi_place(k, bit, 4, 14, 7);
    case Packing::stream10: {
      const std::size_t from_front = 10 * k + (9 - bit);
      return {from_front / 8, static_cast<unsigned>(7 - from_front % 8)};
    }
    case Packing::lowest10:
      return {(10 * k + bit) / 8, static_cast<unsigned>((10 * k + bit) % 8)};
    case Packing::lowest12:
      return {(12 * k + bit) / 8, static_cast<unsigned>((12 * k + bit) % 8)};
    case Packing::gev10:
      return gev_place(k, bit, 2);
    case Packing::gev12:
      return gev_place(k, bit, 4);
    case Packing::luma_first:
      return {2 * k, bit};
    case Packing::luma_second:
      return {2 * k + 1, bit};
  }
  return {};
}

void put_sample(Bytes& row, const PixelFormat& format, std::size_t k, unsigned code) {
  for (unsigned bit = 0; bit < static_cast<unsigned>(format.bits); ++bit) {
    const auto [byte, in] = place(format.packing, k, bit + static_cast<unsigned>(format.shift));
    const auto mask = static_cast<std::byte>(1U << in);
    row.at(byte) = (code >> bit & 1U) != 0 ? row.at(byte) | mask : row.at(byte) & ~mask;
  }
}

class EveryFormat : public testing::TestWithParam<PixelFormat> {};

TEST_P(EveryFormat, gives_back_the_codes_that_were_put_bit_by_bit) {
  const PixelFormat& format = GetParam();
  std::mt19937 random(2006);
  const unsigned most = (1U << format.bits) - 1;
  for (const int cols : {1, 2, 3, 4, 5, 7, 8, 64, 639}) {
    Bytes row(row_bytes(format, cols));  // not a byte more: a sanitizer sees who reads beyond it
    std::vector<std::uint16_t> expected, codes(static_cast<std::size_t>(cols));
    for (std::size_t k = 0; k < codes.size(); ++k) {
      expected.push_back(static_cast<std::uint16_t>(k == 0 ? most : random() & most));
      put_sample(row, format, k, expected.back());
    }
    const auto seen = unpack(format.packing, {format.bits, format.shift}, row, codes);
    EXPECT_EQ(codes, expected) << format.name << ", " << cols << " columns";
    EXPECT_EQ(seen >> (format.bits + format.shift), 0);
    EXPECT_EQ(seen & ((1U << format.shift) - 1), 0U);
  }
}

TEST_P(EveryFormat, chroma_and_neighbours_do_not_leak_in) {
  const PixelFormat& format = GetParam();
  std::mt19937 random(7);
  Bytes row(row_bytes(format, 16));
  for (std::byte& byte : row) byte = static_cast<std::byte>(random());
  std::vector<std::uint16_t> codes(16);
  for (std::size_t k = 0; k < 16; ++k) put_sample(row, format, k, k == 5 ? 0U : 1U);
  unpack(format.packing, {format.bits, format.shift}, row, codes);
  for (std::size_t k = 0; k < 16; ++k) {
    // Words hold more than the sample: what stands beside it may be anything, and counts as out of range.
    if (format.packing == Packing::words && format.bits + format.shift < 16) continue;
    EXPECT_EQ(codes[k], k == 5 ? 0 : 1) << format.name << " " << k;
  }
}

INSTANTIATE_TEST_SUITE_P(Pfnc, EveryFormat,
                         testing::ValuesIn(camera::genicam_formats().begin(),
                                           camera::genicam_formats().end()),
                         [](const auto& format) { return std::string(format.param.name); });
INSTANTIATE_TEST_SUITE_P(Unpack, EveryFormat,
                         testing::ValuesIn(pixel_formats().begin(), pixel_formats().end()),
                         [](const auto& format) { return std::string(format.param.name); });

TEST(Unpack, a_sample_with_more_bits_than_told_is_the_largest_code_and_shows) {
  const Bytes row{std::byte{0x00}, std::byte{0x04}, std::byte{0xFF}, std::byte{0x03}};  // 1024, 1023
  std::array<std::uint16_t, 2> codes{};
  const auto seen = unpack(Packing::words, {10, 0}, row, codes);
  EXPECT_EQ(codes[0], 1023);
  EXPECT_EQ(codes[1], 1023);
  EXPECT_NE(seen >> 10, 0);
}

TEST(Unpack, a_depth_in_the_upper_bits_is_shifted_down_and_bits_below_show) {
  const Bytes row{std::byte{0x50}, std::byte{0xAB}, std::byte{0x01}, std::byte{0x00}};
  std::array<std::uint16_t, 2> codes{};
  const auto seen = unpack(Packing::words, {12, 4}, row, codes);
  EXPECT_EQ(codes[0], 0xAB5);
  EXPECT_EQ(codes[1], 0);
  EXPECT_EQ(seen & 15U, 1U);
}

// Bytes as the kernel's documentation prints them, put down by hand: the reference above could be wrong in
// the same way as the code.
TEST(Unpack, examples_by_hand) {
  const auto first = [](Packing packing, int bits, const std::vector<unsigned>& bytes, std::size_t count) {
    Bytes row;
    for (const unsigned byte : bytes) row.push_back(static_cast<std::byte>(byte));
    std::vector<std::uint16_t> codes(count);
    unpack(packing, {bits, 0}, row, codes);
    return codes;
  };
  using Codes = std::vector<std::uint16_t>;
  // 0x3FF, 0x001, 0x200, 0x155: high bytes FF 00 80 55; low pairs 11, 01, 00, 01 → 01 00 01 11.
  EXPECT_EQ(first(Packing::mipi10, 10, {0xFF, 0x00, 0x80, 0x55, 0x47}, 4),
            (Codes{0x3FF, 0x001, 0x200, 0x155}));
  EXPECT_EQ(first(Packing::mipi12, 12, {0xAB, 0x12, 0x3C}, 2), (Codes{0xABC, 0x123}));
  // Low six: 0x01, 0x02, 0x03, 0x3F = bits 111111 000011 000010 000001.
  EXPECT_EQ(first(Packing::mipi14, 14, {0x00, 0x00, 0x00, 0xFF, 0x81, 0x30, 0xFC}, 4),
            (Codes{1, 2, 3, 0x3FFF}));
  EXPECT_EQ(first(Packing::stream10, 10, {0xFF, 0xC0, 0x18, 0x01, 0x55}, 4),
            (Codes{0x3FF, 0x001, 0x200, 0x155}));
  // 0x3FF, 0x001, 0x200, 0x155 as bits from the lowest: 1111111111 1000000000 0000000001 1010101010.
  EXPECT_EQ(first(Packing::lowest10, 10, {0xFF, 0x07, 0x00, 0x60, 0x55}, 4),
            (Codes{0x3FF, 0x001, 0x200, 0x155}));
  EXPECT_EQ(first(Packing::lowest12, 12, {0xBC, 0x3A, 0x12}, 2), (Codes{0xABC, 0x123}));
  EXPECT_EQ(first(Packing::gev10, 10, {0xFF, 0x13, 0x00}, 2), (Codes{0x3FF, 0x001}));
  EXPECT_EQ(first(Packing::gev12, 12, {0xAB, 0x3C, 0x12}, 2), (Codes{0xABC, 0x123}));
  EXPECT_EQ(first(Packing::luma_first, 8, {1, 99, 2, 98}, 2), (Codes{1, 2}));
  EXPECT_EQ(first(Packing::luma_second, 8, {99, 1, 98, 2}, 2), (Codes{1, 2}));
  EXPECT_EQ(first(Packing::words_high_first, 16, {0x12, 0x34}, 1), (Codes{0x1234}));
}

TEST(PixelFormat, names_and_codes_are_found_and_stand_once) {
  std::set<std::string_view> names;
  std::set<std::uint32_t> codes;
  for (const PixelFormat& format : pixel_formats()) {
    EXPECT_TRUE(names.insert(format.name).second) << format.name;
    EXPECT_TRUE(codes.insert(format.fourcc).second) << format.name;
    EXPECT_EQ(find_pixel_format(format.name)->fourcc, format.fourcc);
    EXPECT_EQ(find_pixel_format(fourcc_text(format.fourcc))->fourcc, format.fourcc);
    EXPECT_LE(format.bits + format.shift, 16);
  }
  EXPECT_EQ(find_pixel_format("RG10")->name, "SRGGB10");
  EXPECT_EQ(find_pixel_format("BA81")->mosaic, Mosaic::bggr);
  EXPECT_EQ(find_pixel_format("Y16-BE")->packing, Packing::words_high_first);
  EXPECT_EQ(find_pixel_format("MJPG"), nullptr);
  EXPECT_FALSE(find_pixel_format("YUYV")->linear);
}

// A PFNC code says in its bits 16 to 23 how many bits of memory a pixel takes.
TEST(Pfnc, codes_stand_once_and_agree_with_packing_and_name) {
  std::set<std::uint32_t> codes;
  for (const PixelFormat& format : camera::genicam_formats()) {
    EXPECT_TRUE(codes.insert(format.fourcc).second) << format.name;
    EXPECT_EQ(row_bytes(format, 8), (format.fourcc >> 16U & 0xFFU)) << format.name;
    EXPECT_EQ(camera::find_genicam_format(format.name), &format);
    EXPECT_NE(format.name.find(std::to_string(format.bits)), std::string_view::npos);
    EXPECT_EQ(format.name.starts_with("Bayer"), format.mosaic != Mosaic::none);
  }
  EXPECT_EQ(camera::find_genicam_format("RGB8"), nullptr);
}

TEST(PixelFormat, a_mosaic_and_its_name_agree) {
  for (const PixelFormat& format : pixel_formats()) {
    const bool bayer = format.name.starts_with("S");
    EXPECT_EQ(bayer, format.mosaic != Mosaic::none) << format.name;
    if (!bayer) continue;
    std::string colours(format.name.substr(1, 4));
    for (char& c : colours) c = static_cast<char>(c - 'A' + 'a');
    EXPECT_EQ(name(format.mosaic), colours);
  }
}

TEST(PixelFormat, fourcc_text_hides_what_is_no_character) {
  EXPECT_EQ(fourcc_text(0x20303159), "Y10");
  EXPECT_EQ(fourcc_text(0x00000007), "????");
}

}  // namespace
}  // namespace symrig::unpack_test
