// SPDX-License-Identifier: Apache-2.0

#include "report/charts.hpp"

#include "report/html.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include <fmt/format.h>

namespace symrig::report {

namespace {

constexpr double kWidth = 340, kHeight = 232, kLeft = 52, kRight = 12, kTop = 24, kBottom = 40;

/// A logarithmic axis from value `low` at pixel `from` to value `high` at pixel `to`.
struct LogAxis {
  double low = 1, high = 10, from = 0, to = 1;

  double at(double value) const {
    const double share = std::log(std::clamp(value, low, high) / low) / std::log(high / low);
    return from + share * (to - from);
  }
};

/// An axis with some space around the values, over at least a factor of 2.
LogAxis axis_over(const std::vector<double>& values, double from, double to) {
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  const double air = std::max(1.15, std::pow(*most / *least, 0.06));
  const double widen = std::max(1.0, std::sqrt(2 / (*most / *least * air * air)));
  return {*least / air / widen, *most * air * widen, from, to};
}

/// The largest number ≤ `value` that is 1, 2 or 5 times a power of ten.
double round_step(double value) {
  const double decade = std::pow(10.0, std::floor(std::log10(value)));
  return value >= 5 * decade ? 5 * decade : value >= 2 * decade ? 2 * decade : decade;
}

/// Ticks in equal steps. On an axis of less than a decade they give more ticks than leading digits do.
std::vector<double> even_ticks(const LogAxis& axis) {
  const double step = round_step((axis.high - axis.low) / 3);
  std::vector<double> values;
  for (auto n = static_cast<int>(std::ceil(axis.low / step)); n * step <= axis.high; ++n)
    values.push_back(n * step);
  return values;
}

/// Round values on an axis: 1, 2, 5 of each decade, or only the decades if there are many.
std::vector<double> ticks(const LogAxis& axis) {
  const double decades = std::log10(axis.high / axis.low);
  if (decades < 0.9) return even_ticks(axis);
  const int step = std::max(1, static_cast<int>(std::ceil(decades / 6)));
  std::vector<double> values;
  for (int d = static_cast<int>(std::floor(std::log10(axis.low))); std::pow(10.0, d) <= axis.high; d += step)
    for (const double digit : {1.0, 2.0, 5.0}) {
      const double value = digit * std::pow(10.0, d);
      const bool shown = digit == 1 || decades < 2;
      if (shown && value >= axis.low && value <= axis.high) values.push_back(value);
    }
  return values;
}

std::string tick_text(double value) {
  return value >= 1 ? grouped(value) : fmt::format("{:g}", value);
}

std::string grid_lines(const LogAxis& x, const LogAxis& y, const CurveChart& chart) {
  const auto cost_text = chart.cost_text != nullptr ? chart.cost_text : tick_text;
  const auto error_text = chart.error_text != nullptr ? chart.error_text : tick_text;
  std::string svg;
  for (const double value : ticks(x)) {
    const double at = x.at(value);
    svg += fmt::format(
        R"(<line class="axis" x1="{0:.1f}" x2="{0:.1f}" y1="{1}" y2="{2}"/><text class="soft" x="{0:.1f}" y="{3}" text-anchor="middle">{4}</text>)",
        at, kTop, kHeight - kBottom, kHeight - kBottom + 15, escape(cost_text(value)));
  }
  for (const double value : ticks(y)) {
    const double at = y.at(value);
    svg += fmt::format(
        R"(<line class="axis" x1="{1}" x2="{2}" y1="{0:.1f}" y2="{0:.1f}"/><text class="soft" x="{3}" y="{4:.1f}" text-anchor="end">{5}</text>)",
        at, kLeft, kWidth - kRight, kLeft - 5, at + 4, escape(error_text(value)));
  }
  return svg;
}

std::string shape(Marker marker, double x, double y, double r) {
  switch (marker) {
    case Marker::circle:
      return fmt::format(R"(<circle cx="{:.1f}" cy="{:.1f}" r="{:.1f}")", x, y, r);
    case Marker::square:
      return fmt::format(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}")", x - 0.9 * r,
                         y - 0.9 * r, 1.8 * r, 1.8 * r);
    case Marker::triangle:
      return fmt::format(R"(<path d="M{:.1f} {:.1f}l{:.1f} {:.1f}h{:.1f}z")", x, y - 1.1 * r, 1.1 * r, 2 * r,
                         -2.2 * r);
    case Marker::diamond:
      break;
  }
  return fmt::format(R"(<path d="M{:.1f} {:.1f}l{r:.1f} {r:.1f}l-{r:.1f} {r:.1f}l-{r:.1f} -{r:.1f}z")", x,
                     y - 1.2 * r, fmt::arg("r", 1.2 * r));
}

std::string error_bar(const CurveSeries& series, const CurveDot& one, const LogAxis& x, const LogAxis& y) {
  if (!(one.high > one.low)) return {};
  const double at = x.at(one.at.cost);
  const double top = y.at(one.high), bottom = y.at(one.low);
  return fmt::format(
      R"(<path d="M{0:.1f} {1:.1f}V{2:.1f}M{3:.1f} {1:.1f}h6M{3:.1f} {2:.1f}h6" style="fill:none;stroke:var({4});stroke-width:1.2"/>)",
      at, top, bottom, at - 3, series.colour);
}

std::string label(const CurveDot& one, const LogAxis& x, const LogAxis& y) {
  if (one.label.empty()) return {};
  const double at = x.at(one.at.cost);
  const bool left = at > kWidth - kRight - 40;
  return fmt::format(R"(<text class="halo" x="{:.1f}" y="{:.1f}" text-anchor="{}">{}</text>)",
                     at + (left ? -7 : 7), y.at(one.at.error) - 5, left ? "end" : "start", escape(one.label));
}

std::string dot(const CurveSeries& series, const CurveDot& one, const LogAxis& x, const LogAxis& y) {
  const char* ring = one.ringed ? ";stroke:var(--ink);stroke-width:1.5" : ";fill-opacity:0.6";
  return shape(series.marker, x.at(one.at.cost), y.at(one.at.error), one.ringed ? 4.2 : 3.2) +
         fmt::format(R"( style="fill:var({}){}"><title>{}</title></{}>)", series.colour, ring,
                     escape(one.title),
                     series.marker == Marker::circle   ? "circle"
                     : series.marker == Marker::square ? "rect"
                                                       : "path");
}

std::string drawn(const CurveSeries& series, const LogAxis& x, const LogAxis& y) {
  std::string points;
  for (const CostError& p : series.line) points += fmt::format("{:.1f},{:.1f} ", x.at(p.cost), y.at(p.error));
  std::string svg;
  if (series.line.size() > 1)
    svg += fmt::format(R"(<polyline points="{}" style="fill:none;stroke:var({});stroke-width:1.8"/>)", points,
                       series.colour);
  for (const CurveDot& one : series.dots)
    svg += error_bar(series, one, x, y) + dot(series, one, x, y) + label(one, x, y);
  return svg;
}

std::string frame(const CurveChart& chart) {
  return fmt::format(
      R"(<text x="{}" y="14" style="font-weight:600">{}</text><text class="soft" x="{}" y="{}" text-anchor="middle">{}</text>)",
      kLeft, escape(chart.title), (kLeft + kWidth - kRight) / 2, kHeight - 6, escape(chart.cost_label));
}

constexpr double kBeyond = 1e30;

bool drawable(const CostError& p) {
  return p.cost > 1 / kBeyond && p.cost < kBeyond && p.error >= 0 && p.error < kBeyond;
}

/// Removes points that the axes cannot show.
CurveChart drawable(CurveChart chart) {
  for (CurveSeries& series : chart.series) {
    std::erase_if(series.dots, [](const CurveDot& one) { return !drawable(one.at); });
    std::erase_if(series.line, [](const CostError& p) { return !drawable(p); });
    for (CurveDot& one : series.dots)
      if (!(one.low >= 0 && one.low < one.high && one.high < kBeyond)) one.low = one.high = 0;
  }
  return chart;
}

std::string in_words(const char* words) {
  return fmt::format(R"(<text class="soft" x="{}" y="{}" text-anchor="middle">{}</text>)",
                     (kLeft + kWidth - kRight) / 2, kHeight / 2, words);
}

std::string curves(const CurveChart& chart, const std::vector<double>& costs,
                   const std::vector<double>& errors) {
  const LogAxis x = axis_over(costs, kLeft, kWidth - kRight);
  const LogAxis y = axis_over(errors, kHeight - kBottom, kTop);
  std::string svg = grid_lines(x, y, chart);
  if (chart.target > 0)
    svg += fmt::format(
        R"(<line x1="{0}" x2="{1}" y1="{2:.1f}" y2="{2:.1f}" style="stroke:var(--soft);stroke-dasharray:4 4"/>)",
        kLeft, kWidth - kRight, y.at(chart.target));
  for (const CurveSeries& series : chart.series) svg += drawn(series, x, y);
  return svg;
}

}  // namespace

std::string curve_chart(const CurveChart& asked) {
  const CurveChart chart = drawable(asked);
  std::vector<double> costs, errors;
  for (const CurveSeries& series : chart.series)
    for (const CurveDot& one : series.dots) {
      costs.push_back(one.at.cost);
      for (const double error : {one.at.error, one.low, one.high})
        if (error > 0) errors.push_back(error);
    }
  const std::string inside = costs.empty()    ? in_words("nothing was captured")
                             : errors.empty() ? in_words("no error in any capture")
                                              : curves(chart, costs, errors);
  return fmt::format(R"(<svg viewBox="0 0 {} {}" role="img" aria-label="{}: {} over {}">)", kWidth, kHeight,
                     escape(chart.title), escape(chart.error_label), escape(chart.cost_label)) +
         frame(chart) + inside + "</svg>\n";
}

std::string marker_sample(const std::string& colour, Marker marker) {
  const CurveSeries series{.colour = colour, .marker = marker, .dots = {}, .line = {}};
  const LogAxis middle{1, 10, 6, 6};
  return R"(<svg viewBox="0 0 12 12" aria-hidden="true" style="display:inline-block;width:0.9rem;margin:0 0.3rem 0 0;vertical-align:-0.1rem">)" +
         dot(series, {{1, 1}, "", false}, middle, middle) + "</svg>";
}

namespace {

struct Kind {
  std::string_view name;
  std::string_view colour;  ///< role in the page's style
};

constexpr std::array<Kind, 5> kKinds{{{"rank-1", "--rank1"},
                                      {"low rank", "--lowrank"},
                                      {"empty", "--empty"},
                                      {"scalar", "--scalar"},
                                      {"subdivided", "--split"}}};

std::array<std::int64_t, 5> parts(const NodeCounts& n) {
  return {n.leaves.rank1, n.leaves.low_rank, n.leaves.empty, n.leaves.scalar, n.subdivided};
}

std::string legend() {
  std::string html = "<div class=\"legend\">";
  for (const Kind& kind : kKinds)
    html += fmt::format("<span><i style=\"background:var({})\"></i>{}</span>", kind.colour, kind.name);
  return html + "</div>\n";
}

std::string stacked_bar(const NodeCounts& counts, double x, double top, double width, double height) {
  std::string svg;
  double y = top + height;
  for (std::size_t k = 0; k < kKinds.size(); ++k) {
    const auto part = parts(counts)[k];
    if (part == 0 || counts.total() == 0) continue;
    const double share = static_cast<double>(part) / static_cast<double>(counts.total());
    y -= height * share;
    svg += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.2f}\" width=\"{:.1f}\" height=\"{:.2f}\" "
        "style=\"fill:var({});stroke:var(--line)\">"
        "<title>{}: {} ({})</title></rect>",
        x, y, width, height * share, kKinds[k].colour, kKinds[k].name, grouped(static_cast<double>(part)),
        percent(share));
  }
  return svg;
}

}  // namespace

std::string node_bars(const std::vector<NodeCounts>& levels) {
  constexpr double kBarsLeft = 46, kBarsTop = 10, kBarsHeight = 180, kBarsWidth = 440;
  const double step = (kBarsWidth - kBarsLeft) / static_cast<double>(std::max<std::size_t>(1, levels.size()));
  std::string svg =
      legend() + fmt::format(
                     "<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"Share of nodes by kind "
                     "at each level\">",
                     kBarsWidth, kBarsTop + kBarsHeight + 42);
  for (int mark = 0; mark <= 4; ++mark) {
    const double y = kBarsTop + kBarsHeight * (1 - mark / 4.0);
    svg += fmt::format(
        "<line class=\"axis\" x1=\"{0}\" x2=\"{1}\" y1=\"{2}\" y2=\"{2}\"/><text class=\"soft\" x=\"{3}\" "
        "y=\"{4}\" text-anchor=\"end\">{5} %</text>",
        kBarsLeft, kBarsWidth, y, kBarsLeft - 6, y + 4, mark * 25);
  }
  for (std::size_t level = 0; level < levels.size(); ++level) {
    const double x = kBarsLeft + step * (static_cast<double>(level) + 0.15);
    svg += stacked_bar(levels[level], x, kBarsTop, 0.7 * step, kBarsHeight);
    svg += fmt::format(R"(<text x="{:.1f}" y="{}" text-anchor="middle">{}</text>)", x + 0.35 * step,
                       kBarsTop + kBarsHeight + 17, level);
  }
  svg += fmt::format(
      "<text class=\"soft\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">level of the hierarchy (0: the whole "
      "picture)</text>",
      (kBarsLeft + kBarsWidth) / 2, kBarsTop + kBarsHeight + 36);
  return svg + "</svg>\n";
}

namespace {

// Layout of the horizontal bars: labels are left of kBarsLeft, numbers right of each bar.
constexpr double kBarsLeft = 104, kBarsWidth = 440, kBarsText = 118, kBarsRow = 28;
constexpr double kBarsRoom = kBarsWidth - kBarsLeft - kBarsText;

/// The exponent of the first power of ten that no bar exceeds, at least 1.
int decades_over(const std::vector<Bar>& bars) {
  int decades = 1;
  for (const Bar& bar : bars)
    while (decades < 15 && bar.value > std::pow(10.0, decades)) ++decades;
  return decades;
}

std::string bars_axis(int decades, double bottom, const std::string& quantity) {
  std::string svg;
  const int step = decades > 6 ? 3 : decades > 4 ? 2 : 1;
  for (int d = 0; d <= decades; d += step)
    svg += fmt::format(
        R"(<line class="axis" x1="{0:.1f}" x2="{0:.1f}" y1="2" y2="{1}"/><text class="soft" x="{0:.1f}" y="{2}" text-anchor="middle">{3}</text>)",
        kBarsLeft + kBarsRoom * d / decades, bottom, bottom + 15, grouped(std::pow(10.0, d)));
  return svg + fmt::format(R"(<text class="soft" x="{:.1f}" y="{}" text-anchor="middle">{}</text>)",
                           kBarsLeft + kBarsRoom / 2, bottom + 31, escape(quantity));
}

}  // namespace

std::string log_bars(const std::vector<Bar>& bars, const std::string& quantity) {
  const int decades = decades_over(bars);
  const double bottom = kBarsRow * static_cast<double>(bars.size()) + 4;
  std::string svg =
      fmt::format(R"(<svg viewBox="0 0 {} {}" role="img" aria-label="{}, on a logarithmic scale">)",
                  kBarsWidth, bottom + 36, escape(quantity)) +
      bars_axis(decades, bottom, quantity);
  for (std::size_t k = 0; k < bars.size(); ++k) {
    const double y = kBarsRow * static_cast<double>(k) + 6;
    const double value = bars[k].value >= 1 && bars[k].value < 1e15 ? bars[k].value : 1;
    const double length = kBarsRoom * std::log10(value) / decades;
    svg += fmt::format(
        "<text x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text><rect x=\"{}\" y=\"{}\" width=\"{:.1f}\" "
        "height=\"20\" style=\"fill:var({})\"/><text class=\"halo\" x=\"{:.1f}\" y=\"{}\">{}</text>",
        kBarsLeft - 8, y + 15, escape(bars[k].label), kBarsLeft, y, std::max(1.0, length),
        bars[k].accent ? "--accent" : "--empty", kBarsLeft + length + 8, y + 15, escape(bars[k].text));
  }
  return svg + "</svg>\n";
}

}  // namespace symrig::report
