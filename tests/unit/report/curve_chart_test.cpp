// SPDX-License-Identifier: Apache-2.0
#include "report/curve_chart.hpp"

#include <algorithm>
#include <cstdlib>

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
