// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/report/bench.hpp"
#include "symrig/report/summary.hpp"

#include <cstdint>
#include <string>
#include <vector>

/// Error over cost as inline SVG, both axes logarithmic, with colours from the page's style.

namespace symrig::report {

/// Markers differ in shape too, not only in colour.
enum class Marker : std::uint8_t { circle, square, triangle, diamond };

struct CurveDot {
  CostError at;
  std::string title;  ///< shown when the pointer rests on it
  bool ringed = false;
  double low = 0, high = 0;  ///< ends of an error bar; none unless low < high
  std::string label = {};    ///< beside the dot
};

struct CurveSeries {
  std::string colour;  ///< role in the page's style
  Marker marker = Marker::circle;
  std::vector<CurveDot> dots;
  std::vector<CostError> line;  ///< in the order in which it is drawn
};

struct CurveChart {
  std::string title, cost_label, error_label;
  std::vector<CurveSeries> series;  ///< later ones are drawn on top
  double target = 0;                ///< dashed line at this error; 0 = none
  /// The text of costs and errors on the axes; nullptr: plain numbers.
  std::string (*cost_text)(double) = nullptr;
  std::string (*error_text)(double) = nullptr;
};

/// A chart as SVG. A logarithmic axis cannot show error 0, so such a capture is drawn on the lower edge.
/// Without any point, or without any error, the chart contains a sentence. A dot with a cost that is not
/// positive, with a value that is not finite, or beyond 1e±30 is ignored.
std::string curve_chart(const CurveChart& asked);

/// One marker for a line of text.
std::string marker_sample(const std::string& colour, Marker marker);

}  // namespace symrig::report

/// Inline SVG with colours from the page's style.

namespace symrig::report {

/// One bar for each level, divided into the shares of its nodes [Garg06 Fig. 9], with a legend above.
std::string node_bars(const std::vector<NodeCounts>& levels);

struct Bar {
  std::string label;
  double value = 0;
  std::string text;  ///< beside the bar
  bool accent = false;
};

/// Horizontal bars on a logarithmic axis that begins at 1. quantity: the label of the axis.
std::string log_bars(const std::vector<Bar>& bars, const std::string& quantity);

}  // namespace symrig::report
