// SPDX-License-Identifier: Apache-2.0
// The search: its levels, the estimated error over patterns and over seconds of the rig, and what it cost.

#include "report/charts.hpp"
#include "report/html.hpp"
#include "report/sections.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

namespace symrig::report {

namespace {

struct Column {
  const char* name;
  const char* path;  ///< in the JSON of inspect
  std::int64_t (*count)(const NodeCounts&);
};

constexpr std::array<Column, 5> kColumns{
    {{"rank-1", "/leaves_per_level/rank1", [](const NodeCounts& n) { return n.leaves.rank1; }},
     {"low rank", "/leaves_per_level/lowrank", [](const NodeCounts& n) { return n.leaves.low_rank; }},
     {"empty", "/leaves_per_level/empty", [](const NodeCounts& n) { return n.leaves.empty; }},
     {"scalar", "/leaves_per_level/scalar", [](const NodeCounts& n) { return n.leaves.scalar; }},
     {"subdivided", "/subdivided_per_level", [](const NodeCounts& n) { return n.subdivided; }}}};

std::string counts_table(const Context& context, const std::vector<NodeCounts>& counts) {
  std::vector<std::string> head{"level"};
  for (const Column& column : kColumns) head.emplace_back(column.name);
  Csv csv(head);
  std::vector<std::vector<std::string>> rows;
  for (std::size_t level = 0; level < counts.size(); ++level) {
    std::vector<std::string> row{std::to_string(level)};
    std::vector<std::string> plain{std::to_string(level)};
    for (const Column& column : kColumns) {
      const auto count = static_cast<double>(column.count(counts[level]));
      row.push_back(number(count, fmt::format("inspect:{}/{}", column.path, level), grouped(count)));
      plain.push_back(exact(count));
    }
    rows.push_back(std::move(row));
    csv.add(plain);
  }
  return number_table_html("Nodes by level", head, rows) +
         save_row(csv.link(context.file("levels"), "nodes by level"));
}

/// A tensor without levels: from dual photography, brute force, or fitted to photographs.
std::string stored_section(const TransportTensor& tensor) {
  const auto count = [](std::size_t n) { return grouped(static_cast<double>(n)); };
  return section(
      "levels", "What is stored",
      paragraph("This tensor was not measured level by level, so it has no levels to show.") +
          facts_table({{"Low-rank leaves", count(tensor.leaves().size())},
                       {"Single entries of T", count(static_cast<std::size_t>(tensor.scalar_count()))},
                       {"Measured columns of T", count(tensor.columns().size())},
                       {"Entries in those columns", count(tensor.column_rows().size())}}));
}

}  // namespace

Result<std::string> levels_section(const Context& context) {
  const TransportTensor& tensor = context.tensor();
  if (!tensor.symmetric()) return stored_section(tensor);
  const std::vector<NodeCounts> counts = node_counts(tensor);
  SYMRIG_TRY(const std::string maps, maps_over_the_picture(context));
  SYMRIG_TRY(const std::string pictures, pictures_by_level(context));
  return section(
      "levels", "Level by level",
      paragraph("Each level divides a block into four, and a pair of blocks (a node) into sixteen. The bars "
                "show shares of the nodes on each level. T is symmetric; each pair counts once. Empty: below "
                "noise and tolerance. Scalar: a single entry of T.") +
          node_bars(counts) + counts_table(context, counts) + maps + pictures + ranks_of_leaves(tensor));
}

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

namespace {

/// The time of brute force is in proportion to its patterns. Really it would also need longer exposures.
std::string pattern_bars(const CaptureFacts& facts) {
  const auto patterns = count_at(facts, "/patterns");
  const auto brute = count_at(facts, "/patterns_brute_force");
  if (!patterns || !brute || !(patterns->value > 0)) return {};
  const auto rig = count_at(facts, "/rig_seconds");
  const auto with_time = [&](double count) {
    return grouped(count) + (rig ? fmt::format(" ({})", duration(rig->value * count / patterns->value)) : "");
  };
  return paragraph(
             "Number of patterns, with the time on the rig's clock. Brute force shows one pixel at a time. "
             "Its time is in proportion to its patterns (single pixels would need longer exposures).") +
         log_bars({{facts.text("/algorithm").value_or("this capture"), patterns->value,
                    with_time(patterns->value), true},
                   {"brute force", brute->value, with_time(brute->value), false}},
                  "patterns");
}

bool any(const std::vector<Stage>& stages, std::optional<Sourced> Stage::*what) {
  return std::any_of(stages.begin(), stages.end(),
                     [&](const Stage& stage) { return (stage.*what).has_value(); });
}

std::string error_cell(const Stage& stage) {
  const std::string uncertainty = sourced_text(stage.uncertainty, percent);
  return sourced_text(stage.error, percent) + (uncertainty.empty() ? "" : " ± " + uncertainty);
}

/// One row for each stage: its cost, and the state of the tensor at its end.
std::string stage_table(const Context& context) {
  const std::vector<Stage>& stages = context.stages;
  if (stages.size() < 2) return {};
  const bool seconds = any(stages, &Stage::rig_seconds), errors = any(stages, &Stage::error);
  std::vector<std::string> head{"stage", "patterns", "total patterns"};
  if (seconds) head.emplace_back("total time on the rig's clock");
  if (errors) head.emplace_back("estimated error at the end of this stage");
  std::vector<std::vector<std::string>> rows;
  Csv csv({"stage", "patterns", "patterns_by_then", "rig_seconds_by_then", "estimated_error", "uncertainty"});
  for (const Stage& stage : stages) {
    std::vector<std::string> row{escape(stage.name), sourced_text(stage.patterns, grouped),
                                 sourced_text(stage.by_then, grouped)};
    if (seconds)
      row.push_back((stage.seconds_scaled ? "≈ " : "") + sourced_text(stage.rig_seconds, duration));
    if (errors) row.push_back(error_cell(stage));
    rows.push_back(std::move(row));
    csv.add({stage.name, exact_or_empty(stage.patterns), exact_or_empty(stage.by_then),
             exact_or_empty(stage.rig_seconds), exact_or_empty(stage.error),
             exact_or_empty(stage.uncertainty)});
  }
  return "<h3>Stage by stage</h3>\n" +
         paragraph(
             "Before the levels: the flood-lit and the held-out photographs. After the last level: combs of "
             "pixels where light travels only a few pixels, and flood-lit photographs for the direct "
             "light.") +
         number_table_html("Stages", head, rows) + save_row(csv.link(context.file("stages"), "stages"));
}

using Rows = std::vector<std::pair<std::string, std::string>>;

void add_seconds(Rows& rows, const CaptureFacts& facts, const char* path, const char* meaning) {
  if (const auto value = count_at(facts, path)) rows.emplace_back(meaning, sourced_text(value, duration));
}

std::string time_table(const CaptureFacts& facts) {
  Rows rows;
  const bool simulated = facts.text("/scene").value_or("").starts_with("sim:");
  if (const auto end = facts.text("/stopped_by"); end && *end != "done")
    rows.emplace_back("Stopped early by the budget", escape(*end));
  add_seconds(rows, facts, "/rig_seconds",
              simulated ? "On the rig's clock (simulated capture time)" : "On the rig's clock");
  add_seconds(rows, facts, "/seconds/total", "On this computer, in total");
  add_seconds(rows, facts, "/seconds/measure",
              simulated ? "… waiting for photographs (simulating the scene, merging)"
                        : "… waiting for photographs (merging included)");
  add_seconds(rows, facts, "/seconds/merge", "… merging exposures (part of the line above)");
  add_seconds(rows, facts, "/seconds/process", "… subtracting, testing, scheduling");
  add_seconds(rows, facts, "/seconds/refine", "… final refit and merging of leaves");
  const auto patterns = count_at(facts, "/patterns");
  const auto process = count_at(facts, "/seconds/process");
  const auto merge = count_at(facts, "/seconds/merge");
  if (patterns && process && patterns->value > 0)
    rows.emplace_back("Processing of each photograph (merging included)",
                      duration((process->value + (merge ? merge->value : 0)) / patterns->value));
  if (const auto peak = count_at(facts, "/peak_memory_bytes"))
    rows.emplace_back("Peak memory", sourced_text(peak, byte_size));
  if (const auto noise = facts.text("/noise"); noise && simulated)
    rows.emplace_back("Camera noise in the simulation", escape(*noise));
  return rows.empty() ? std::string() : "<h3>Time and memory</h3>\n" + facts_table(rows);
}

}  // namespace

std::string cost_section(const Context& context) {
  const std::string body = pattern_bars(context.facts) + stage_table(context) + time_table(context.facts);
  return body.empty() ? body : section("cost", "Cost", body);
}

}  // namespace symrig::report
