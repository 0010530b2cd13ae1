// SPDX-License-Identifier: Apache-2.0

#include "report/charts.hpp"

#include "report/picture.hpp"
#include "symrig/image/file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <string_view>

#include <gtest/gtest.h>

namespace symrig::report::curve_chart_test {

namespace {

CurveChart chart_of(const std::vector<CostError>& points, Marker marker = Marker::circle) {
  CurveSeries series{.colour = "--accent", .marker = marker, .dots = {}, .line = points};
  for (const CostError& p : points) series.dots.push_back({p, "a <dot>", false});
  return {.title = "gummy", .cost_label = "patterns", .error_label = "indirect", .series = {series}};
}

std::vector<double> attributes(const std::string& svg, const std::string& name) {
  std::vector<double> values;
  const std::string word = " " + name + "=\"";
  for (std::size_t at = svg.find(word); at != std::string::npos; at = svg.find(word, at + 1))
    values.push_back(std::strtod(svg.c_str() + at + word.size(), nullptr));
  return values;
}

// 10, 100, 1000 in both directions: equal steps on logarithmic axes. Pixels are written with one decimal.
TEST(CurveChart, both_axes_are_logarithmic) {
  const std::string svg = curve_chart(chart_of({{10, 1}, {100, 0.1}, {1000, 0.01}}));
  for (const char* axis : {"cx", "cy"}) {
    const std::vector<double> at = attributes(svg, axis);
    ASSERT_EQ(at.size(), 3U);
    EXPECT_NEAR(at[1] - at[0], at[2] - at[1], 0.21);
    EXPECT_GT(at[1], at[0]);  // more patterns to the right, less error further down
  }
}

TEST(CurveChart, everything_lies_inside) {
  for (const double factor : {1.0, 1.01, 3.0, 1e6}) {
    const std::string svg = curve_chart(chart_of({{7, 0.3}, {7 * factor, 0.3 / factor}}));
    for (const double x : attributes(svg, "cx")) EXPECT_TRUE(x > 52 && x < 328) << factor << ": " << x;
    for (const double y : attributes(svg, "cy")) EXPECT_TRUE(y > 24 && y < 192) << factor << ": " << y;
    EXPECT_EQ(svg.find("nan"), std::string::npos);
    EXPECT_EQ(svg.find("inf\""), std::string::npos);
  }
}

TEST(CurveChart, every_axis_has_at_least_two_ticks) {
  for (const double factor : {1.0, 1.5, 7.0, 30.0, 1e3, 1e9}) {
    const std::string svg = curve_chart(chart_of({{123, 0.37}, {123 * factor, 0.37 / factor}}));
    const auto labels = [&svg](const std::string& anchor) {
      std::size_t n = 0;
      const std::string word = "text-anchor=\"" + anchor + "\"";
      for (std::size_t at = svg.find(word); at != std::string::npos; at = svg.find(word, at + 1)) ++n;
      return n;
    };
    EXPECT_GE(labels("end"), 2U) << factor;
    EXPECT_GE(labels("middle"), 3U) << factor;  // two and the name of the axis
    EXPECT_LE(labels("end"), 14U) << factor;
  }
}

TEST(CurveChart, a_capture_without_error_stands_on_the_lower_edge) {
  const std::vector<double> y = attributes(curve_chart(chart_of({{10, 0.1}, {20, 0}})), "cy");
  ASSERT_EQ(y.size(), 2U);
  EXPECT_NEAR(y[1], 192, 0.05);
}

// A file may tell any number.
TEST(CurveChart, what_has_no_place_on_the_axes_is_left_out) {
  CurveChart chart =
      chart_of({{10, 0.1}, {20, 0.05}, {0, 0.1}, {-3, 0.1}, {1e308, 0.1}, {30, 1e308}, {40, -1}});
  chart.series[0].dots[0].low = 0.05;
  chart.series[0].dots[0].high = 0.2;
  chart.series[0].dots[1].low = -1;
  chart.series[0].dots[1].high = 1e308;
  const std::string svg = curve_chart(chart);
  EXPECT_EQ(attributes(svg, "cx").size(), 2U);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  std::size_t bars = 0;
  for (std::size_t at = svg.find("h6\""); at != std::string::npos; at = svg.find("h6\"", at + 1)) ++bars;
  EXPECT_EQ(bars, 1U);
}

TEST(CurveChart, nothing_to_draw_is_said_in_words) {
  EXPECT_NE(curve_chart(chart_of({})).find("nothing was captured"), std::string::npos);
  EXPECT_NE(curve_chart(chart_of({{10, 0}})).find("no error in any capture"), std::string::npos);
}

TEST(CurveChart, text_cannot_become_markup) {
  EXPECT_EQ(curve_chart(chart_of({{10, 1}})).find("<dot>"), std::string::npos);
}

TEST(CurveChart, every_marker_is_closed) {
  for (const Marker marker : {Marker::circle, Marker::square, Marker::triangle, Marker::diamond}) {
    const std::string svg = curve_chart(chart_of({{10, 1}, {20, 0.5}}, marker));
    const std::string element = marker == Marker::circle   ? "circle"
                                : marker == Marker::square ? "rect"
                                                           : "path";
    EXPECT_NE(svg.find("<" + element + " "), std::string::npos);
    EXPECT_NE(svg.find("</" + element + ">"), std::string::npos);
    EXPECT_NE(marker_sample("--accent", marker).find("<" + element + " "), std::string::npos);
  }
}

}  // namespace

}  // namespace symrig::report::curve_chart_test

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

namespace symrig::report::pixel_depth_test {

namespace {

// 2 x 2 pixels, all of them blocks of level 1: pixel 0 has a direct entry, an entry with 3 and an empty pair
// with 1.
TEST(PixelDepth, counts_every_leaf_in_a_row_of_T) {
  TensorBuilder builder(BlockTree({2, 2}), 1);
  const std::array<float, 1> one{1};
  for (std::int32_t i = 0; i < 4; ++i) builder.add_scalar(i, i, one);
  builder.add_scalar(3, 0, one);
  builder.add_empty(1, 1, 0);
  const PixelDepth depth = pixel_depth(std::move(builder).finish());
  EXPECT_EQ(depth.terms.at(0, 0), 2);
  EXPECT_EQ(depth.terms.at(1, 1), 2);
  EXPECT_EQ(depth.terms.at(0, 1), 1);
  for (const float level : depth.level.values()) EXPECT_EQ(level, 1);
}

// Two blocks of level 1 see each other through a leaf of rank 2: each pixel has half its entries there.
TEST(PixelDepth, weighs_levels_by_entries) {
  const BlockTree tree({4, 4});
  TensorBuilder builder(tree, 1);
  const Block& a = tree.level(1)[0];
  const Block& b = tree.level(1)[1];
  builder.add_leaf(b.begin, b.end, a.begin, a.end, 2, 1, std::vector<float>(16, 1.0F));
  const std::array<float, 1> one{1};
  builder.add_scalar(a.begin, a.begin, one);
  const PixelDepth depth = pixel_depth(std::move(builder).finish());
  EXPECT_EQ(depth.terms.at(0, 0), 3);
  EXPECT_EQ(depth.terms.at(0, 1), 2);
  EXPECT_FLOAT_EQ(depth.level.at(0, 0), (4 * 1 + 1 * 2) / 5.0F);
  EXPECT_EQ(depth.level.at(0, 1), 1);
  EXPECT_EQ(depth.level.at(3, 3), 0);  // nothing is stored there
}

}  // namespace

}  // namespace symrig::report::pixel_depth_test
