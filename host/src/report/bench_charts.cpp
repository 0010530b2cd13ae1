// SPDX-License-Identifier: Apache-2.0
#include "report/bench_charts.hpp"

#include "report/curve_chart.hpp"
#include "report/html.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::report {
namespace {

struct Look {
  Algorithm algorithm;
  const char* colour;
  Marker marker;
};

/// Of each algorithm, in the order of the legend. Drawn in reverse order, so that symrig lies on top.
std::vector<Look> looks() {
  constexpr std::array<std::pair<const char*, Marker>, 4> kMarks{{{"--accent", Marker::circle},
                                                                  {"--rank1", Marker::square},
                                                                  {"--scalar", Marker::triangle},
                                                                  {"--empty", Marker::diamond}}};
  std::vector<Look> all;
  for (const AlgorithmInfo& one : algorithms()) {
    const auto& [colour, marker] = kMarks[all.size() % kMarks.size()];
    all.push_back({one.algorithm, colour, marker});
  }
  return all;
}

CurveDot dot_of(const BenchCapture& c, const CostAxis& cost, const ErrorAxis& error) {
  const double e = c.error.*error.of;
  const std::string tolerance =
      c.what.tolerance ? fmt::format(", tolerance {:.2g}", *c.what.tolerance) : std::string();
  return {{cost.of(c), e},
          fmt::format("{}{}, seed {}: {} patterns, {}, {} {}", name(c.what.algorithm), tolerance, c.what.seed,
                      grouped(static_cast<double>(c.patterns)), duration(c.capture_seconds()), error.label,
                      short_number(e)),
          c.what.preset && algorithm_info(c.what.algorithm).tolerance};
}

/// Sums of logarithms of one tolerance over the seeds.
struct LogSum {
  double cost = 0, error = 0;
  int count = 0;
};

/// Geometric means over the seeds, large tolerances first. Captures with error 0 have no logarithm and are
/// ignored.
std::vector<CostError> mean_line(const std::vector<const BenchCapture*>& captures, const CostAxis& cost,
                                 const ErrorAxis& error) {
  std::map<double, LogSum, std::greater<>> sums;
  for (const BenchCapture* c : captures) {
    const CostError at{cost.of(*c), c->error.*error.of};
    if (at.cost <= 0 || at.error <= 0) continue;
    LogSum& sum = sums[c->what.tolerance.value_or(0)];
    sum.cost += std::log(at.cost);
    sum.error += std::log(at.error);
    ++sum.count;
  }
  std::vector<CostError> line;
  line.reserve(sums.size());
  for (const auto& [tolerance, sum] : sums)
    line.push_back({std::exp(sum.cost / sum.count), std::exp(sum.error / sum.count)});
  return line;
}

CurveSeries series_of(const Look& look, const std::vector<const BenchCapture*>& captures,
                      const CostAxis& cost, const ErrorAxis& error) {
  CurveSeries series{
      .colour = look.colour, .marker = look.marker, .dots = {}, .line = mean_line(captures, cost, error)};
  for (const BenchCapture* c : captures) series.dots.push_back(dot_of(*c, cost, error));
  return series;
}

/// Geometric mean over seeds of the error of paper at its default tolerance; 0 if there is none.
double reference_error(const std::vector<const BenchCapture*>& captures, const ErrorAxis& error) {
  std::vector<const BenchCapture*> presets;
  std::copy_if(captures.begin(), captures.end(), std::back_inserter(presets),
               [](const BenchCapture* c) { return c->what.preset; });
  const std::vector<CostError> line = mean_line(presets, kPatternAxis, error);
  return line.empty() ? 0 : line.front().error;
}

std::string scene_chart(const BenchRun& run, const std::string& scene, const BenchSummary& of,
                        const CostAxis& cost, const ErrorAxis& error) {
  CurveChart chart{.title = scene, .cost_label = cost.label, .error_label = error.label, .series = {}};
  for (const Look& look : looks()) {
    std::vector<const BenchCapture*> captures;
    for (const BenchCapture& c : run.captures)
      if (c.done() && c.what.scene == scene && c.what.grid == of.grid && c.what.profile == of.profile &&
          c.what.algorithm == look.algorithm)
        captures.push_back(&c);
    if (algorithm_info(look.algorithm).reference) chart.target = reference_error(captures, error);
    chart.series.push_back(series_of(look, captures, cost, error));
  }
  std::reverse(chart.series.begin(), chart.series.end());
  return curve_chart(chart);
}

}  // namespace

std::string bench_charts(const BenchRun& run, const BenchSummary& of, const CostAxis& cost,
                         const ErrorAxis& error) {
  std::vector<std::string> charts;
  for (const std::string& scene : run.plan.scenes)
    charts.push_back("<figure>" + scene_chart(run, scene, of, cost, error) + "</figure>\n");
  constexpr int kLeast = 310;  // CSS pixels: three in a row on a desktop screen, one on a phone
  return row_of(charts, kLeast);
}

std::string bench_legend(const BenchPlan& plan) {
  std::string html = "<div class=\"legend\">";
  for (const Look& look : looks()) {
    const bool runs = std::any_of(plan.sweeps.begin(), plan.sweeps.end(), [&look](const BenchSweep& sweep) {
      return sweep.algorithm == look.algorithm;
    });
    if (runs)
      html += fmt::format("<span>{}{}</span>", marker_sample(look.colour, look.marker), name(look.algorithm));
  }
  return html + "<span>ringed: default tolerance</span><span>dashed: error of paper there</span></div>\n";
}

}  // namespace symrig::report
