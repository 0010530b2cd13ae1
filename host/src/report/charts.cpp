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
  constexpr double kLeft = 46, kTop = 10, kHeight = 180, kWidth = 440;
  const double step = (kWidth - kLeft) / static_cast<double>(std::max<std::size_t>(1, levels.size()));
  std::string svg =
      legend() + fmt::format(
                     "<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"Share of nodes by kind "
                     "at each level\">",
                     kWidth, kTop + kHeight + 42);
  for (int mark = 0; mark <= 4; ++mark) {
    const double y = kTop + kHeight * (1 - mark / 4.0);
    svg += fmt::format(
        "<line class=\"axis\" x1=\"{0}\" x2=\"{1}\" y1=\"{2}\" y2=\"{2}\"/><text class=\"soft\" x=\"{3}\" "
        "y=\"{4}\" text-anchor=\"end\">{5} %</text>",
        kLeft, kWidth, y, kLeft - 6, y + 4, mark * 25);
  }
  for (std::size_t level = 0; level < levels.size(); ++level) {
    const double x = kLeft + step * (static_cast<double>(level) + 0.15);
    svg += stacked_bar(levels[level], x, kTop, 0.7 * step, kHeight);
    svg += fmt::format(R"(<text x="{:.1f}" y="{}" text-anchor="middle">{}</text>)", x + 0.35 * step,
                       kTop + kHeight + 17, level);
  }
  svg += fmt::format(
      "<text class=\"soft\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">level of the hierarchy (0: the whole "
      "picture)</text>",
      (kLeft + kWidth) / 2, kTop + kHeight + 36);
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
