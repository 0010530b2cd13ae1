// SPDX-License-Identifier: Apache-2.0

#include "report/ratio_text.hpp"
#include "symrig/report/bench.hpp"
#include "symrig/report/text.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig::report {

namespace {

std::string with_reach(Reach reach, double value) {
  return (reach == Reach::at_most ? "≤ " : "") + text::short_number(value);
}

}  // namespace

std::string ratio_text(const CurveReading& reading) {
  return reading.reached() ? with_reach(reading.reach, reading.value) : "-";
}

std::string mean_text(const MeanRatio& mean) {
  if (mean.averaged == 0) return "-";
  std::string text = with_reach(mean.bounds > 0 ? Reach::at_most : Reach::read, mean.value);
  const int all = mean.averaged + mean.not_reached + mean.zero;
  if (mean.not_reached > 0) text += fmt::format(" ({} of {} not reached)", mean.not_reached, all);
  if (mean.zero > 0) text += fmt::format(" ({} of {} zero)", mean.zero, all);
  return text;
}

const FloodBias* flood_of_symrig(const BenchSummary& summary, const std::string& scene) {
  const auto found = std::find_if(summary.flood.begin(), summary.flood.end(), [&scene](const FloodBias& b) {
    return b.scene == scene && b.algorithm == Algorithm::symrig;
  });
  return found == summary.flood.end() ? nullptr : &*found;
}

}  // namespace symrig::report

namespace symrig {

namespace {

using report::mean_text;
using text::short_number;

constexpr const char* kRow =
    "{:<17}{:<9}{:<7}{:>10}{:>5}{:>10}{:>10}{:>15}{:>10}{:>10}{:>10}{:>11}{:>10}{:>10}{:>10}{:>14}{:>10}\n";

std::string tolerance_text(const BenchCase& what) {
  if (!what.tolerance) return "-";
  return fmt::format("{:.2g}{}", *what.tolerance, what.preset ? "*" : "");
}

double worst_relight(const TransportErrors& e) {
  return std::max({e.relight_bar, e.relight_random, e.relight_natural});
}

constexpr const char* kSummaryRow = "  {:<18}{:>13}{:>14}{:>13}{:>13}{:>14}{:>15}{:>11}\n";

std::string scene_row(const BenchSummary& summary, const std::string& scene) {
  const std::vector<BenchPair> pairs = pairs_of(summary, scene);
  const auto cell = [&pairs](CurveReading BenchPair::*reading) { return mean_text(mean_of(pairs, reading)); };
  const FloodBias* bias = report::flood_of_symrig(summary, scene);
  return fmt::format(kSummaryRow, scene, cell(&BenchPair::patterns_at_indirect),
                     cell(&BenchPair::patterns_at_bar_indirect), cell(&BenchPair::patterns_at_both),
                     cell(&BenchPair::indirect_at_patterns), cell(&BenchPair::frobenius_at_patterns),
                     bias != nullptr && bias->at_preset > 0 ? short_number(bias->at_preset) : "-",
                     bias != nullptr ? short_number(bias->worst) : "-");
}

std::string size_text(const BenchRun& run, const BenchSummary& s) {
  if (s.pairs.empty()) return {};
  std::string text = fmt::format("\n{}{}: symrig / paper\n", to_string(s.grid),
                                 s.profile == "standard" ? "" : ", profile " + s.profile);
  text += fmt::format(kSummaryRow, "", "patterns at", "patterns at", "patterns at", "indirect at",
                      "frobenius at", "symrig, flood", "the same,");
  text += fmt::format(kSummaryRow, "scene", "indirect", "bar_indirect", "both", "= patterns", "= patterns",
                      "/ frobenius", "worst");
  for (const std::string& scene : run.plan.scenes)
    if (!pairs_of(s, scene).empty()) text += scene_row(s, scene);
  text += fmt::format("  geometric means over {} pairs of scene and seed\n", s.pairs.size());
  text += fmt::format("    patterns at paper's indirect       {}\n", mean_text(s.patterns_at_indirect));
  text += fmt::format("    patterns at paper's bar_indirect   {}\n", mean_text(s.patterns_at_bar_indirect));
  text += fmt::format("    patterns at both                   {}\n", mean_text(s.patterns_at_both));
  text += fmt::format("    indirect at paper's patterns       {}\n", mean_text(s.indirect_at_patterns));
  text += fmt::format("    frobenius at paper's patterns      {}\n", mean_text(s.frobenius_at_patterns));
  return text;
}

std::string incomplete_text(const BenchRun& run) {
  if (run.complete()) return {};
  return fmt::format("incomplete: {} of {} captures were run\n", run.captures.size(), run.planned);
}

std::string speed_line(const RelightSpeed& relight, const ThreadSpeed& speed) {
  return fmt::format("  {} thread{}: triad {:.1f} GB/s, one relit photograph {} cold: {} of triad\n",
                     speed.threads, speed.threads == 1 ? "" : "s", 1e-9 * speed.triad_bytes_per_second,
                     text::duration(speed.relight_seconds), text::percent(relight.share_of_triad(speed)));
}

std::string relight_text(const BenchRun& run) {
  if (!run.relight) return {};
  const RelightSpeed& r = *run.relight;
  const std::string lines = speed_line(r, r.one) + (r.all.threads > 1 ? speed_line(r, r.all) : std::string());
  return fmt::format("\nmemory speed (arrays of {}) and relighting, {}, {}\n{}",
                     text::byte_size(static_cast<double>(r.array_bytes)), run.relight_of,
                     text::byte_size(static_cast<double>(r.tensor_bytes)), lines);
}

}  // namespace

std::string bench_table_head() {
  return fmt::format(kRow, "scene", "size", "method", "tolerance", "seed", "patterns", "frames", "rig",
                     "host", "wall", "tensor", "frobenius", "indirect", "flood", "relight", "bar_indirect",
                     "profile");
}

std::string bench_table_row(const BenchCapture& c) {
  const std::string_view method = name(c.what.algorithm);
  if (!c.done())
    return fmt::format("{:<17}{:<9}{:<7}{:>10}{:>5}  failed: {}\n", c.what.scene, to_string(c.what.grid),
                       method, tolerance_text(c.what), c.what.seed, c.failure);
  const TransportErrors& e = c.error;
  return fmt::format(kRow, c.what.scene, to_string(c.what.grid), method, tolerance_text(c.what), c.what.seed,
                     text::grouped(static_cast<double>(c.patterns)),
                     text::grouped(static_cast<double>(c.frames)), text::duration(c.rig_seconds),
                     text::duration(c.host_seconds()), text::duration(c.wall_seconds),
                     text::byte_size(static_cast<double>(c.tensor_bytes)), short_number(e.frobenius),
                     short_number(e.indirect), short_number(e.flood), short_number(worst_relight(e)),
                     short_number(e.bar_indirect), c.what.profile);
}

std::string bench_summary_text(const BenchRun& run) {
  std::string text;
  for (const BenchSummary& summary : summarize(run)) text += size_text(run, summary);
  if (!text.empty()) text += std::string("\n") + report::kRatioNote + "\n";
  const std::string marks = "* default tolerance; relight: the worst of bar, random and natural\n";
  return marks + incomplete_text(run) + text + relight_text(run);
}

}  // namespace symrig
