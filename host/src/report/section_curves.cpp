// SPDX-License-Identifier: Apache-2.0
// The estimated error over patterns, and over seconds of the rig.
#include "report/curve_chart.hpp"
#include "report/html.hpp"
#include "report/save_link.hpp"
#include "report/sections.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig::report {
namespace {

using CostOf = std::optional<Sourced> Stage::*;

std::string percent_tick(double share) {
  return fmt::format("{:g} %", 100 * share);
}

std::string seconds_tick(double seconds) {
  return (seconds >= 1 ? grouped(seconds) : fmt::format("{:g}", seconds)) + " s";
}

CurveDot dot_of(const Stage& stage, double cost) {
  CurveDot dot{{cost, stage.error->value},
               fmt::format("{}: {}", stage.name, percent(stage.error->value)),
               !stage.level.has_value()};
  if (stage.level) dot.label = std::to_string(*stage.level);
  if (!stage.uncertainty) return dot;
  dot.title += fmt::format(" ± {}", percent(stage.uncertainty->value));
  dot.low = std::max(stage.error->value / 10, stage.error->value - stage.uncertainty->value);
  dot.high = stage.error->value + stage.uncertainty->value;
  return dot;
}

CurveSeries estimates(const Context& context, CostOf cost) {
  CurveSeries series{.colour = "--rank1", .marker = Marker::circle, .dots = {}, .line = {}};
  for (const Stage& stage : context.stages) {
    if (!stage.error || !(stage.*cost)) continue;
    series.dots.push_back(dot_of(stage, (stage.*cost)->value));
    series.line.push_back(series.dots.back().at);
  }
  return series;
}

CurveSeries truth(const Context& context, CostOf cost) {
  CurveSeries series{.colour = "--accent", .marker = Marker::diamond, .dots = {}, .line = {}};
  const std::optional<Sourced>& finished = context.stages.back().*cost;
  if (context.errors && finished)
    series.dots.push_back({{finished->value, context.errors->frobenius},
                           fmt::format("finished, against the truth: {}", percent(context.errors->frobenius)),
                           true});
  return series;
}

std::string chart(const Context& context, const char* label, CostOf cost, std::string (*cost_text)(double)) {
  return curve_chart({.title = fmt::format("Error of T over {}", label),
                      .cost_label = label,
                      .error_label = "relative error of T",
                      .series = {estimates(context, cost), truth(context, cost)},
                      .cost_text = cost_text,
                      .error_text = percent_tick});
}

std::string legend(const Context& context) {
  std::string html = "<div class=\"legend\">";
  const bool any = std::any_of(context.stages.begin(), context.stages.end(),
                               [](const Stage& stage) { return stage.error.has_value(); });
  if (any)
    html += "<span>" + marker_sample("--rank1", Marker::circle) +
            "estimated by the capture after each level (its number beside it), and when it was finished "
            "(ringed)</span>";
  if (context.errors)
    html += "<span>" + marker_sample("--accent", Marker::diamond) + "finished, against the truth</span>";
  return html + "</div>\n";
}

std::string notes(const Context& context) {
  std::string text;
  const auto& stages = context.stages;
  if (std::any_of(stages.begin(), stages.end(), [](const Stage& s) { return s.error && s.level; }))
    text +=
        "The error after a level is that of a capture that stops there (<code>--max-patterns</code>), "
        "before it refits the direct light to all its photographs. This last step reduces the error "
        "further.";
  if (std::any_of(stages.begin(), stages.end(), [](const Stage& s) { return s.error && s.seconds_scaled; }))
    text +=
        "The file does not contain the end time of each level: seconds are in proportion to the "
        "photographs.";
  if (std::any_of(stages.begin(), stages.end(), [](const Stage& s) { return s.uncertainty.has_value(); }))
    text += " Bars: uncertainty of the estimate.";
  return text.empty() ? text : fmt::format("<p class=\"note\">{}</p>\n", text);
}

}  // namespace

std::string error_curves(const Context& context) {
  return "<h3>Error during the capture</h3>\n" + legend(context) +
         row_of({chart(context, "patterns", &Stage::by_then, grouped),
                 chart(context, "seconds of the rig", &Stage::rig_seconds, seconds_tick)},
                480) +
         notes(context);
}

}  // namespace symrig::report
