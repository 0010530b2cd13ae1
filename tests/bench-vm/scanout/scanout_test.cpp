// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scanout/scanout.hpp"

#include "assert_ok.hpp"

#include <random>
#include <string>

#include <gtest/gtest.h>

namespace symrig::bench_vm::scanout_test {
namespace {

Result<ScreenPixels> parse(const std::string& text) {
  return parse_ppm(std::as_bytes(std::span(text)));
}

TEST(Ppm, reads_rows_of_red_green_blue) {
  const auto pixels = parse(std::string("P6\n2 1\n255\n\x01\x02\x03\xff\xfe\x0a", 17));
  ASSERT_OK(pixels);
  EXPECT_EQ(pixels->rows, 1);
  EXPECT_EQ(pixels->cols, 2);
  EXPECT_EQ(pixels->rgb, (std::vector<std::uint32_t>{0x01'02'03, 0xff'fe'0a}));
}

TEST(Ppm, keeps_a_first_sample_that_looks_like_a_blank) {
  const auto pixels = parse("P6 1 1 255\n\n \t");
  ASSERT_OK(pixels);
  EXPECT_EQ(pixels->rgb, std::vector<std::uint32_t>{0x0a'20'09});
}

TEST(Ppm, refuses_all_else) {
  for (const char* text : {"", "P6", "P5\n1 1\n255\nabc", "P6\n1 1\n255", "P6\n1 1\n255\nab",
                           "P6\n1 1\n255\nabcd", "P6\n0 1\n255\n", "P6\n-1 1\n255\nabc", "P6\n1x 1\n255\nabc",
                           "P6\n1 1\n65535\nabcabc", "P6\n99999 99999\n255\nabc"}) {
    const auto pixels = parse(text);
    ASSERT_FALSE(pixels) << text;
    EXPECT_EQ(pixels.error().code, ErrorCode::bad_format);
  }
}

TEST(Ppm, survives_any_bytes_after_its_magic) {
  std::mt19937 random(3);
  for (int i = 0; i < 20'000; ++i) {
    std::string text = "P6";
    for (auto n = random() % 24; n > 0; --n) text += "0123456789 \n\xff"[random() % 13];
    const auto pixels = parse(text);
    if (!pixels) continue;
    EXPECT_EQ(pixels->rgb.size(),
              static_cast<std::size_t>(pixels->rows) * static_cast<std::size_t>(pixels->cols));
  }
}

TEST(DifferingPixels, are_counted_and_all_differ_if_the_sizes_do) {
  const ScreenPixels a{0, 1, 3, {1, 2, 3}};
  EXPECT_EQ(differing_pixels(a, {9, 1, 3, {1, 5, 3}}), 1U);
  EXPECT_EQ(differing_pixels(a, {0, 3, 1, {1, 2, 3}}), 3U);
}

}  // namespace
}  // namespace symrig::bench_vm::scanout_test
