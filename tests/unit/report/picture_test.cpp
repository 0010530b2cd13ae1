// SPDX-License-Identifier: Apache-2.0
#include "report/picture.hpp"

#include "symrig/image/file.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string_view>

#include <gtest/gtest.h>

namespace symrig::report::picture_test {
namespace {

TEST(Picture, white_level_ignores_the_brightest_few_and_what_is_not_a_number) {
  Image<float> image({1, 1001});
  for (int i = 0; i < 1001; ++i) image.at(0, i) = static_cast<float>(i);
  EXPECT_EQ(white_level(image, 0.5), 500.0F);
  EXPECT_EQ(white_level(image, 1.0), 1000.0F);
  image.at(0, 1000) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(white_level(image, 1.0), 999.0F);
  EXPECT_EQ(white_level(Image<float>({2, 2}, 1, -1.0F)), 0.0F);
  EXPECT_EQ(white_level(Image<float>({2, 2}, 1, 0.0F)), 0.0F);
}

// A picture that is dark but for one pixel still has a white.
TEST(Picture, white_level_of_a_single_spark_is_the_spark) {
  Image<float> image({100, 100});
  image.at(7, 7) = 3;
  EXPECT_EQ(white_level(image), 3.0F);
}

TEST(Picture, colours_get_brighter_all_the_way) {
  const auto luminance = [](Rgb c) { return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; };
  EXPECT_EQ(colour_of(0), (Rgb{68, 1, 84}));
  EXPECT_EQ(colour_of(1), (Rgb{253, 231, 37}));
  // Rounding to bytes moves a luminance by up to half a code, so steps of 1/64 (four codes) must still rise.
  for (int k = 0; k < 64; ++k)
    EXPECT_LT(luminance(colour_of(k / 64.0)), luminance(colour_of((k + 1) / 64.0))) << k;
}

// Colours of the published table between those that are kept: straight lines stay within 7 codes. Lightness
// L* [CIE 1976] of the table rises by 76 from end to end, evenly to within 2.5 (its own measure is J' of
// CAM02-UCS).
TEST(Picture, colours_are_those_of_viridis) {
  const std::vector<std::pair<int, Rgb>> published{{104, {41, 122, 142}}, {110, {39, 128, 142}},
                                                   {128, {33, 145, 140}}, {145, {31, 161, 136}},
                                                   {200, {112, 207, 87}}, {247, {234, 229, 26}}};
  for (const auto& [k, colour] : published)
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(colour_of(k / 255.0)[c], colour[c], 7) << k;
  const auto lightness = [](Rgb colour) {
    const auto linear = [](int code) {
      const double v = code / 255.0;
      return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
    };
    const double y = 0.2126 * linear(colour[0]) + 0.7152 * linear(colour[1]) + 0.0722 * linear(colour[2]);
    return 116 * std::cbrt(y) - 16;
  };
  const double first = lightness(colour_of(0)), last = lightness(colour_of(1));
  for (int k = 0; k <= 32; ++k)
    EXPECT_NEAR(lightness(colour_of(k / 32.0)), first + (last - first) * k / 32, 2.5) << k;
}

TEST(Picture, what_is_no_number_has_a_colour_too) {
  EXPECT_EQ(colour_of(std::numeric_limits<double>::quiet_NaN()), colour_of(0));
  EXPECT_EQ(colour_of(std::numeric_limits<double>::infinity()), colour_of(1));
}

TEST(Picture, a_logarithmic_scale_ends_where_it_says) {
  Image<float> image({1, 4});
  image.at(0, 0) = 2;
  image.at(0, 1) = 2e-2F;
  image.at(0, 2) = 1.9e-4F;  // below four decades
  image.at(0, 3) = -1;
  const Picture picture = log_colour(image, 2, 4);
  const auto at = [&](int i) { return Rgb{picture.at(0, i, 0), picture.at(0, i, 1), picture.at(0, i, 2)}; };
  EXPECT_EQ(at(0), colour_of(1));
  EXPECT_EQ(at(1), colour_of(0.5));
  EXPECT_EQ(at(2), colour_of(0));
  EXPECT_EQ(at(3), colour_of(0));
}

TEST(Picture, deeper_levels_are_darker_and_nothing_is_red) {
  for (int level = 0; level < 9; ++level) EXPECT_GT(level_grey(level, 9)[0], level_grey(level + 1, 9)[0]);
  EXPECT_GT(level_grey(-1, 9)[0], level_grey(-1, 9)[1]);
}

TEST(Picture, shrunk_keeps_the_mean_and_the_shape) {
  Image<float> image({400, 200});
  for (std::size_t i = 0; i < image.values().size(); ++i) image.values()[i] = static_cast<float>(i % 7);
  const Image<float> small = shrunk(image, 100);
  EXPECT_EQ(small.grid(), (Grid{100, 50}));
  EXPECT_EQ(shrunk(image, 400), image);
  double before = 0, after = 0;
  for (const float v : image.values()) before += v / 80000.0;
  for (const float v : small.values()) after += v / 5000.0;
  EXPECT_NEAR(after, before, 1e-4);  // 80,000 float sums of values below 7
}

/// Base64 decoded by hand, the slow way.
std::vector<std::byte> decoded(std::string_view text) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<std::byte> bytes;
  std::uint32_t bits = 0;
  int held = 0;
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6U | static_cast<std::uint32_t>(kDigits.find(c));
    held += 6;
    if (held < 8) continue;
    held -= 8;
    bytes.push_back(static_cast<std::byte>(bits >> held & 0xFFU));
  }
  return bytes;
}

// Of every length modulo 3, which is where base64 goes wrong.
TEST(Picture, a_data_uri_is_a_png_of_the_same_pixels) {
  constexpr std::string_view kHead = "data:image/png;base64,";
  for (int cols = 1; cols <= 8; ++cols) {
    Picture picture({3, cols}, 3);
    for (std::size_t i = 0; i < picture.values().size(); ++i)
      picture.values()[i] = static_cast<std::uint8_t>(37 * i + 11);
    const std::string uri = data_uri(picture);
    ASSERT_TRUE(uri.starts_with(kHead));
    const auto read = decode_image(decoded(std::string_view(uri).substr(kHead.size())), "uri");
    ASSERT_TRUE(read.ok()) << read.error().line();
    ASSERT_EQ(read->channels(), 3);
    for (std::size_t i = 0; i < picture.values().size(); ++i)
      EXPECT_EQ(std::lround(255 * read->values()[i]), picture.values()[i]);
  }
}

}  // namespace
}  // namespace symrig::report::picture_test
