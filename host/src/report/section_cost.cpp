// SPDX-License-Identifier: Apache-2.0
#include "report/charts.hpp"
#include "report/html.hpp"
#include "report/sections.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig::report {
namespace {

std::string tile(const std::string& number, const std::string& meaning) {
  return fmt::format("<div class=\"tile\"><b>{}</b><span>{}</span></div>\n", escape(number), escape(meaning));
}

std::string patterns_tile(const CaptureFacts& facts) {
  const auto patterns = facts.number("/patterns");
  if (!patterns) return {};
  const auto brute = facts.number("/patterns_brute_force");
  const std::string meaning =
      brute && *patterns > 0 ? fmt::format("patterns; one pixel at a time would take {}, {:.3g}× as many",
                                           grouped(*brute), *brute / *patterns)
                             : "patterns";
  return tile(grouped(*patterns), meaning);
}

std::string time_tile(const CaptureFacts& facts) {
  const auto rig = facts.number("/rig_seconds");
  if (!rig) return {};
  const auto frames = facts.number("/frames");
  return tile(duration(*rig), "simulated capture time, on the rig's clock" +
                                  (frames ? fmt::format(" ({} frames)", grouped(*frames)) : std::string()));
}

std::string size_tile(const TransportTensor& tensor) {
  const double dense = tensor.dense_bytes();
  return tile(byte_size(static_cast<double>(tensor.bytes())),
              fmt::format("tensor in memory; T as a full matrix: {}", byte_size(dense)));
}

/// Photographs taken by somebody else and the worst prediction of one that was kept back.
std::string photographs_tiles(const Context& context) {
  std::string tiles;
  if (const auto count = context.facts.number("/photographs")) tiles += tile(grouped(*count), "photographs");
  double worst = 0;
  for (const HeldOutError& one : context.held_out) worst = std::max(worst, one.relative());
  if (!context.held_out.empty())
    tiles += tile(percent(worst), "of mean white: rms error of the worst held-out photograph");
  return tiles;
}

std::string what_it_is(const Context& context) {
  const TransportTensor& tensor = context.tensor();
  std::string text = fmt::format("Light transport from a {} projector to a {} camera, {} channel{}",
                                 to_string(tensor.projector_grid()), to_string(tensor.camera_grid()),
                                 tensor.channels(), tensor.channels() == 1 ? "" : "s");
  if (const auto scene = context.facts.text("/scene")) text += "; scene " + *scene;
  if (const auto algorithm = context.facts.text("/algorithm")) text += "; algorithm " + *algorithm;
  return fmt::format("<p class=\"lead\">{}.</p>\n", escape(text));
}

/// "at the same pace" is a plain proportion: brute force would also need longer exposures.
std::string pattern_bars(const CaptureFacts& facts) {
  const auto patterns = facts.number("/patterns");
  const auto brute = facts.number("/patterns_brute_force");
  if (!patterns || !brute || *patterns <= 0) return {};
  const auto rig = facts.number("/rig_seconds");
  const auto with_time = [&](double count) {
    return grouped(count) + (rig ? fmt::format(" ({})", duration(*rig * count / *patterns)) : std::string());
  };
  const std::string html = paragraph(
      "Patterns needed, logarithmic, with the time on the rig's clock; brute force shows one pixel at a "
      "time, and "
      "its time is scaled from this capture at the same pace (single pixels would really need longer "
      "exposures).");
  return html +
         log_bars({{facts.text("/algorithm").value_or("this capture"), *patterns, with_time(*patterns), true},
                   {"brute force", *brute, with_time(*brute), false}});
}

/// The capture's own estimate of its error after each level; empty if it made none.
std::vector<std::string> error_row(const CaptureFacts& facts, std::size_t levels) {
  const std::vector<double> errors = facts.numbers("/error_per_level");
  if (errors.empty()) return {};
  std::vector<std::string> row{"estimated error after it"};
  for (std::size_t k = 0; k < levels; ++k) row.push_back(k < errors.size() ? percent(errors[k]) : "");
  return row;
}

std::string per_level_table(const CaptureFacts& facts) {
  const std::vector<double> levels = facts.numbers("/patterns_per_level");
  if (levels.empty()) return {};
  std::vector<std::string> head{"level"};
  std::vector<std::string> row{"patterns"};
  for (std::size_t k = 0; k < levels.size(); ++k) {
    head.push_back(std::to_string(k));
    row.push_back(grouped(levels[k]));
  }
  std::vector<std::vector<std::string>> rows{row};
  if (const auto errors = error_row(facts, levels.size()); !errors.empty()) rows.push_back(errors);
  return number_table(head, rows);
}

using Rows = std::vector<std::pair<std::string, std::string>>;

void add_seconds(Rows& rows, const CaptureFacts& facts, const char* path, const char* meaning) {
  if (const auto value = facts.number(path)) rows.emplace_back(meaning, duration(*value));
}

std::string time_table(const CaptureFacts& facts) {
  Rows rows;
  if (const auto end = facts.text("/stopped_by"); end && *end != "done")
    rows.emplace_back("Stopped early by the budget", escape(*end));
  add_seconds(rows, facts, "/rig_seconds", "On the rig's clock (simulated capture time)");
  add_seconds(rows, facts, "/seconds/total", "On this computer, all together");
  add_seconds(rows, facts, "/seconds/measure",
              "… waiting for photographs (pretending to be the scene, merging)");
  add_seconds(rows, facts, "/seconds/merge", "… merging exposures (part of the line above)");
  add_seconds(rows, facts, "/seconds/process", "… subtracting, testing, scheduling");
  const auto patterns = facts.number("/patterns");
  const auto process = facts.number("/seconds/process");
  const auto merge = facts.number("/seconds/merge");
  if (patterns && process && *patterns > 0)
    rows.emplace_back("Processing a photograph (merging included)",
                      duration((*process + merge.value_or(0)) / *patterns));
  if (const auto peak = facts.number("/peak_memory_bytes"))
    rows.emplace_back("Peak memory", byte_size(*peak));
  if (const auto noise = facts.text("/noise"))
    rows.emplace_back("Camera noise in the simulation", escape(*noise));
  return rows.empty() ? std::string() : facts_table(rows);
}

}  // namespace

std::string headline(const Context& context) {
  std::string tiles = patterns_tile(context.facts) + time_tile(context.facts) + size_tile(context.tensor()) +
                      photographs_tiles(context);
  if (context.errors)
    tiles += tile(percent(context.errors->frobenius), "error of T (relative, Frobenius)") +
             tile(percent(context.errors->indirect), "error of the indirect light alone");
  return fmt::format("<h1>{}</h1>\n", escape(context.options.title)) + what_it_is(context) +
         "<div class=\"tiles\">" + tiles + "</div>\n";
}

std::string cost_section(const Context& context) {
  const std::string body =
      pattern_bars(context.facts) + per_level_table(context.facts) + time_table(context.facts);
  const std::string json =
      "<details><summary>All that the capture wrote about itself</summary><pre class=\"wide\">" +
      escape(context.facts.json().dump(2, ' ', false, nlohmann::json::error_handler_t::replace)) +
      "</pre></details>\n";
  return section("cost", "What it took", body + json);
}

}  // namespace symrig::report
