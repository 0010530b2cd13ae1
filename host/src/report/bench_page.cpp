// SPDX-License-Identifier: Apache-2.0

#include "report/charts.hpp"
#include "report/html.hpp"
#include "report/ratio_text.hpp"
#include "symrig/report/bench.hpp"
#include "symrig/sim/scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::report {

namespace {

/// The cost of a capture.
struct CostAxis {
  const char* label;
  double (*of)(const BenchCapture& capture);
};

constexpr CostAxis kPatternAxis{"patterns",
                                [](const BenchCapture& c) { return static_cast<double>(c.patterns); }};

constexpr CostAxis kRigAxis{"rig seconds", [](const BenchCapture& c) { return c.rig_seconds; }};

constexpr CostAxis kSecondAxis{"seconds", [](const BenchCapture& c) { return c.capture_seconds(); }};

struct ErrorAxis {
  const char* label;
  double TransportErrors::*of;
};

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

/// One chart for each scene of a size and profile, side by side. Each capture is a marker; each algorithm has
/// a line (geometric mean over the seeds).
std::string bench_charts(const BenchRun& run, const BenchSummary& of, const CostAxis& cost,
                         const ErrorAxis& error) {
  std::vector<std::string> charts;
  for (const std::string& scene : run.plan.scenes)
    charts.push_back("<figure>" + scene_chart(run, scene, of, cost, error) + "</figure>\n");
  constexpr int kLeast = 310;  // CSS pixels: three in a row on a desktop screen, one on a phone
  return row_of(charts, kLeast);
}

/// The legend: the marker of each algorithm of the plan.
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

}  // namespace

}  // namespace symrig::report

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
  const auto cell = [&pairs](CurveReading BenchPair::*reading) { return mean_text(mean_of(pairs, reading)); };
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
