// SPDX-License-Identifier: Apache-2.0
#include "report/charts.hpp"
#include "report/html.hpp"
#include "report/save_link.hpp"
#include "report/sections.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig::report {
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
