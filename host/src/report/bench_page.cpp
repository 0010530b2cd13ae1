// SPDX-License-Identifier: Apache-2.0
#include "report/bench_charts.hpp"
#include "report/html.hpp"
#include "report/ratio_text.hpp"
#include "symrig/report/bench.hpp"
#include "symrig/sim/scene.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

namespace symrig {
namespace {

using report::escape, report::mean_text, report::paragraph, report::short_number;

constexpr std::array<report::ErrorAxis, 3> kErrors{{{"indirect", &TransportErrors::indirect},
                                                    {"bar_indirect", &TransportErrors::bar_indirect},
                                                    {"frobenius", &TransportErrors::frobenius}}};
constexpr std::array<const char*, 3> kMeanings{"light between lit pixels and other pixels: no direct light",
                                               "light outside a vertical bar with an eighth of the width",
                                               "all of T; the bright direct light dominates it"};

std::string joined_words(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

std::string lead(const BenchRun& run) {
  std::vector<std::string> sizes;
  for (const Grid size : run.plan.sizes) sizes.push_back(to_string(size));
  std::string text = fmt::format(
      "{} simulated scene{} at {}, {} seed{}, {} channel{}, camera noise {}: {} captures, each "
      "compared with the exact transport.",
      run.plan.scenes.size(), run.plan.scenes.size() == 1 ? "" : "s", joined_words(sizes),
      run.plan.seeds.size(), run.plan.seeds.size() == 1 ? "" : "s", run.plan.channels,
      run.plan.channels == 1 ? "" : "s", run.plan.camera_noise ? "on" : "off", run.captures.size());
  std::string html = fmt::format("<p class=\"lead\">{}</p>\n", escape(text));
  if (!run.complete())
    html += paragraph(fmt::format(
        "<b>Incomplete: the bench was stopped after {} of {} captures. The results below are from "
        "these.</b>",
        run.captures.size(), run.planned));
  return html;
}

/// The size, with the profile of the rig if it is not always the standard one.
std::string place_of(const BenchPlan& plan, const BenchSummary& s) {
  const bool standard = plan.profiles == std::vector<std::string>{"standard"};
  return standard ? to_string(s.grid) : to_string(s.grid) + ", " + s.profile;
}

std::string tile(const std::string& number, const std::string& meaning) {
  return fmt::format("<div class=\"tile\"><b>{}</b><span>{}</span></div>\n", escape(number), escape(meaning));
}

std::string tiles(const BenchRun& run, const std::vector<BenchSummary>& summaries) {
  std::string html;
  for (const BenchSummary& s : summaries) {
    if (s.pairs.empty()) continue;
    const std::string at = ", symrig / paper at " + place_of(run.plan, s);
    html += tile(mean_text(s.patterns_at_indirect), "patterns at equal indirect error" + at);
    html += tile(mean_text(s.patterns_at_bar_indirect), "patterns at equal bar_indirect" + at);
    html += tile(mean_text(s.indirect_at_patterns), "indirect error at equal patterns" + at);
    html += tile(mean_text(s.frobenius_at_patterns), "frobenius error at equal patterns" + at);
  }
  if (run.relight)
    html += tile(report::percent(run.relight->share_of_triad(run.relight->one)),
                 "of memory speed: relighting the largest tensor, not in any cache, one thread");
  return html.empty() ? html : "<div class=\"tiles\">" + html + "</div>\n";
}

std::vector<std::string> scene_cells(const BenchSummary& s, const std::string& scene) {
  const std::vector<BenchPair> pairs = pairs_of(s, scene);
  const auto cell = [&pairs](Reading BenchPair::*reading) { return mean_text(mean_of(pairs, reading)); };
  const FloodBias* bias = report::flood_of_symrig(s, scene);
  double patterns = 0;
  for (const BenchPair& pair : pairs) patterns += pair.paper_patterns / static_cast<double>(pairs.size());
  return {scene,
          report::grouped(patterns),
          cell(&BenchPair::patterns_at_indirect),
          cell(&BenchPair::patterns_at_bar_indirect),
          cell(&BenchPair::patterns_at_both),
          cell(&BenchPair::indirect_at_patterns),
          cell(&BenchPair::frobenius_at_patterns),
          bias != nullptr && bias->at_preset > 0 ? short_number(bias->at_preset) : "-",
          bias != nullptr ? short_number(bias->worst) : "-"};
}

std::string summary_table(const BenchRun& run, const BenchSummary& s) {
  if (s.pairs.empty())
    return paragraph("This run does not contain both symrig and paper, so there is no comparison.");
  std::vector<std::vector<std::string>> rows;
  for (const std::string& scene : run.plan.scenes)
    if (!pairs_of(s, scene).empty()) rows.push_back(scene_cells(s, scene));
  rows.push_back({"geometric mean", "", mean_text(s.patterns_at_indirect),
                  mean_text(s.patterns_at_bar_indirect), mean_text(s.patterns_at_both),
                  mean_text(s.indirect_at_patterns), mean_text(s.frobenius_at_patterns), "", ""});
  return report::number_table({"symrig / paper", "paper's patterns", "patterns at its indirect",
                               "patterns at its bar_indirect", "patterns at both", "indirect at its patterns",
                               "frobenius at its patterns", "flood / frobenius of symrig",
                               "the same, worst of all tolerances"},
                              rows) +
         fmt::format("<p class=\"note\">{}</p>\n", report::kRatioNote);
}

std::string charts_over(const BenchRun& run, const BenchSummary& of, const report::CostAxis& cost) {
  std::string html;
  for (std::size_t k = 0; k < kErrors.size(); ++k)
    html += paragraph(fmt::format("<b>{}</b> over {}: {}.", kErrors[k].label, cost.label, kMeanings[k])) +
            report::bench_charts(run, of, cost, kErrors[k]);
  return html;
}

/// Sums over captures.
struct TimeSum {
  int captures = 0;
  double rig = 0, light = 0, camera = 0, projector = 0, host = 0;

  void add(const BenchCapture& c) {
    ++captures;
    rig += c.rig_seconds;
    light += c.rig_time.light;
    camera += c.rig_time.camera;
    projector += c.rig_time.projector;
    host += c.host_seconds();
  }
};

std::vector<std::string> time_cells(const BenchRun& run, const BenchSummary& of, Algorithm algorithm) {
  TimeSum sum;
  for (const BenchCapture& c : run.captures)
    if (c.done() && c.what.preset && c.what.grid == of.grid && c.what.profile == of.profile &&
        c.what.algorithm == algorithm)
      sum.add(c);
  if (sum.captures == 0) return {};
  const auto mean = [&sum](double seconds) { return report::duration(seconds / sum.captures); };
  return {std::string(name(algorithm)), mean(sum.rig), mean(sum.light), mean(sum.camera),
          mean(sum.projector),          mean(sum.host)};
}

std::string about_profile(const std::string& profile) {
  for (const RigProfile& one : rig_profiles())
    if (one.name == profile) return std::string(one.about);
  return {};
}

/// Where the time of the captures at the default tolerance went.
std::string time_table(const BenchRun& run, const BenchSummary& of) {
  std::vector<std::vector<std::string>> rows;
  for (const BenchSweep& sweep : run.plan.sweeps)
    if (const auto cells = time_cells(run, of, sweep.algorithm); !cells.empty()) rows.push_back(cells);
  if (rows.empty()) return {};
  return paragraph(fmt::format("The rig: {}. Means over the captures at the default tolerance. Light: the "
                               "shutter is open. Camera: it reads out. Projector: the rest of the rig's "
                               "time. Host: the processing time of this computer, beside the rig's.",
                               escape(about_profile(of.profile)))) +
         report::number_table({"algorithm", "rig", "light", "camera", "projector", "host"}, rows);
}

std::string size_sections(const BenchRun& run, const BenchSummary& s) {
  const std::string size = place_of(run.plan, s);
  const std::string id = s.profile == "standard" ? to_string(s.grid) : to_string(s.grid) + "-" + s.profile;
  const std::string legend = report::bench_legend(run.plan);
  return report::section("summary-" + id, size + ": summary", summary_table(run, s)) +
         report::section("patterns-" + id, size + ": error against patterns",
                         legend + charts_over(run, s, report::kPatternAxis)) +
         report::section("rig-" + id, size + ": error against rig seconds",
                         time_table(run, s) + legend + charts_over(run, s, report::kRigAxis)) +
         report::section(
             "seconds-" + id, size + ": error against seconds",
             paragraph("Seconds on the rig's clock plus the processing time of this computer (merging, "
                       "subtracting, "
                       "testing, scheduling). The time for simulating the scene is not included.") +
                 legend + charts_over(run, s, report::kSecondAxis));
}

std::string speed_section(const BenchRun& run) {
  if (!run.relight) return {};
  const RelightSpeed& r = *run.relight;
  std::vector<std::vector<std::string>> rows;
  for (const ThreadSpeed& speed : {r.one, r.all})
    if (rows.empty() || speed.threads > 1)
      rows.push_back({std::to_string(speed.threads),
                      fmt::format("{:.1f} GB/s", 1e-9 * speed.triad_bytes_per_second),
                      report::duration(speed.relight_seconds), report::percent(r.share_of_triad(speed))});
  return report::section(
      "relight", "Relighting against memory speed",
      paragraph(
          fmt::format("The largest tensor of this run ({}, {}), not in any cache, alternating with a triad "
                      "over arrays of {}. Share: bytes of the tensor a second over bytes of the triad a "
                      "second.",
                      escape(run.relight_of), report::byte_size(static_cast<double>(r.tensor_bytes)),
                      report::byte_size(static_cast<double>(r.array_bytes)))) +
          report::number_table({"threads", "triad", "one photograph", "share of triad"}, rows));
}

std::vector<std::string> capture_row(const BenchCapture& c) {
  std::vector<std::string> row{c.what.scene,
                               to_string(c.what.grid),
                               std::string(name(c.what.algorithm)),
                               c.what.tolerance ? fmt::format("{:.2g}", *c.what.tolerance) : "-",
                               std::to_string(c.what.seed),
                               c.what.profile};
  if (!c.done()) {
    row.push_back("failed: " + c.failure);
    return row;
  }
  const TransportErrors& e = c.error;
  for (const std::string& cell :
       {report::grouped(static_cast<double>(c.patterns)), report::grouped(static_cast<double>(c.frames)),
        report::duration(c.rig_seconds), report::duration(c.rig_time.light),
        report::duration(c.rig_time.camera), report::duration(c.rig_time.projector),
        report::duration(c.host_seconds()), report::duration(c.wall_seconds),
        report::byte_size(static_cast<double>(c.tensor_bytes))})
    row.push_back(cell);
  for (const double error :
       {e.frobenius, e.indirect, e.flood, e.relight_bar, e.relight_random, e.relight_natural, e.bar_indirect})
    row.push_back(short_number(error));
  return row;
}

std::string captures_section(const BenchRun& run) {
  std::vector<std::vector<std::string>> rows;
  for (const BenchCapture& capture : run.captures) rows.push_back(capture_row(capture));
  return report::section(
      "captures", "Every capture",
      "<details><summary>Show the table</summary>" +
          report::number_table(
              {"scene",           "size",        "algorithm", "tolerance",   "seed",
               "profile",         "patterns",    "frames",    "rig",         "light",
               "camera",          "projector",   "host",      "wall",        "tensor",
               "frobenius",       "indirect",    "flood",     "relight bar", "relight random",
               "relight natural", "bar_indirect"},
              rows) +
          "</details>\n");
}

}  // namespace

std::string bench_page(const BenchRun& run) {
  const std::vector<BenchSummary> summaries = summarize(run);
  std::string body = "<h1>Speed against error</h1>\n" + lead(run) + tiles(run, summaries);
  for (const BenchSummary& summary : summaries) body += size_sections(run, summary);
  body += speed_section(run) + captures_section(run);
  return report::page("Speed against error", body + "<footer>Made by <code>symrig bench</code>.</footer>\n");
}

}  // namespace symrig
