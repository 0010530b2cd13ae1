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

std::string log_bars(const std::vector<Bar>& bars) {
  constexpr double kLeft = 120, kWidth = 440, kText = 130, kRow = 30;
  double most = 10;
  for (const Bar& bar : bars) most = std::max(most, bar.value);
  std::string svg =
      fmt::format(R"(<svg viewBox="0 0 {} {}" role="img" aria-label="Bars on a logarithmic scale">)", kWidth,
                  kRow * static_cast<double>(bars.size()) + 6);
  for (std::size_t k = 0; k < bars.size(); ++k) {
    const double y = kRow * static_cast<double>(k) + 4;
    const double length =
        (kWidth - kLeft - kText) * std::max(0.0, std::log10(std::max(1.0, bars[k].value)) / std::log10(most));
    svg += fmt::format(
        "<text x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text><rect x=\"{}\" y=\"{}\" width=\"{:.1f}\" "
        "height=\"20\" "
        "style=\"fill:var({})\"/><text class=\"soft\" x=\"{:.1f}\" y=\"{}\">{}</text>",
        kLeft - 8, y + 15, escape(bars[k].label), kLeft, y, length, bars[k].accent ? "--accent" : "--empty",
        kLeft + length + 8, y + 15, escape(bars[k].text));
  }
  return svg + "</svg>\n";
}

}  // namespace symrig::report
