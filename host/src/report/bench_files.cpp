// SPDX-License-Identifier: Apache-2.0

#include "symrig/report/bench.hpp"
#include "symrig/report/internal/json_text.hpp"

#include <cmath>
#include <string_view>

#include <fmt/format.h>

namespace symrig {

namespace {

using report::grid_json;
using report::Json;
using report::json_text;

std::string_view reach_name(Reach reach) {
  switch (reach) {
    case Reach::read:
      return "read";
    case Reach::at_most:
      return "at_most";
    case Reach::not_reached:
      break;
  }
  return "not_reached";
}

Json plan_json(const BenchPlan& plan) {
  Json sizes = Json::array(), sweeps = Json::array();
  for (const Grid size : plan.sizes) sizes.push_back(grid_json(size));
  for (const BenchSweep& sweep : plan.sweeps)
    sweeps.push_back({{"algorithm", name(sweep.algorithm)},
                      {"tolerances", sweep.tolerances},
                      {"preset", sweep.preset > 0 ? Json(sweep.preset) : Json(nullptr)}});
  return {{"scenes", plan.scenes},
          {"sizes", sizes},
          {"seeds", plan.seeds},
          {"sweeps", sweeps},
          {"noise", plan.camera_noise ? "camera" : "off"},
          {"channels", plan.channels},
          {"profiles", plan.profiles}};
}

Json errors_json(const TransportErrors& e) {
  return {{"frobenius", e.frobenius},
          {"indirect", e.indirect},
          {"flood", e.flood},
          {"relight", {{"bar", e.relight_bar}, {"random", e.relight_random}, {"natural", e.relight_natural}}},
          {"bar_indirect", e.bar_indirect}};
}

Json case_json(const BenchPlan& plan, const BenchCase& what) {
  return {{"rig", bench_rig(plan, what)},
          {"scene", what.scene},
          {"grid", grid_json(what.grid)},
          {"seed", what.seed},
          {"algorithm", name(what.algorithm)},
          {"tolerance", what.tolerance ? Json(*what.tolerance) : Json(nullptr)},
          {"preset", what.preset},
          {"profile", what.profile}};
}

Json capture_json(const BenchPlan& plan, const BenchCapture& c) {
  Json json = case_json(plan, c.what);
  if (!c.done()) {
    json["failure"] = c.failure;
    return json;
  }
  json["patterns"] = c.patterns;
  json["frames"] = c.frames;
  json["rig_seconds"] = c.rig_seconds;
  json["rig_time"] = {
      {"light", c.rig_time.light}, {"camera", c.rig_time.camera}, {"projector", c.rig_time.projector}};
  json["seconds"] = {{"host", c.host_seconds()},
                     {"process", c.process_seconds},
                     {"merge", c.merge_seconds},
                     {"simulate", c.simulate_seconds},
                     {"wall", c.wall_seconds}};
  json["tensor_bytes"] = c.tensor_bytes;
  json["error"] = errors_json(c.error);
  return json;
}

Json reading_json(const CurveReading& reading) {
  return {{"ratio", reading.reached() ? Json(reading.value) : Json(nullptr)},
          {"reach", reach_name(reading.reach)}};
}

Json mean_json(const MeanRatio& mean) {
  return {{"geometric_mean", mean.averaged > 0 ? Json(mean.value) : Json(nullptr)},
          {"reach", reach_name(mean.reach())},
          {"averaged", mean.averaged},
          {"at_most", mean.bounds},
          {"not_reached", mean.not_reached},
          {"zero", mean.zero}};
}

Json pair_json(const BenchPair& pair) {
  return {{"scene", pair.scene},
          {"seed", pair.seed},
          {"paper", {{"patterns", pair.paper_patterns}, {"error", errors_json(pair.paper_error)}}},
          {"patterns_at_indirect", reading_json(pair.patterns_at_indirect)},
          {"patterns_at_bar_indirect", reading_json(pair.patterns_at_bar_indirect)},
          {"patterns_at_both", reading_json(pair.patterns_at_both)},
          {"indirect_at_patterns", reading_json(pair.indirect_at_patterns)},
          {"frobenius_at_patterns", reading_json(pair.frobenius_at_patterns)}};
}

Json summary_json(const BenchSummary& s) {
  Json pairs = Json::array(), flood = Json::array();
  for (const BenchPair& pair : s.pairs) pairs.push_back(pair_json(pair));
  for (const FloodBias& bias : s.flood)
    flood.push_back({{"scene", bias.scene},
                     {"algorithm", name(bias.algorithm)},
                     {"at_preset", bias.at_preset},
                     {"worst", bias.worst}});
  return {{"grid", grid_json(s.grid)},
          {"profile", s.profile},
          {"symrig_over_paper",
           {{"patterns_at_indirect", mean_json(s.patterns_at_indirect)},
            {"patterns_at_bar_indirect", mean_json(s.patterns_at_bar_indirect)},
            {"patterns_at_both", mean_json(s.patterns_at_both)},
            {"indirect_at_patterns", mean_json(s.indirect_at_patterns)},
            {"frobenius_at_patterns", mean_json(s.frobenius_at_patterns)}}},
          {"pairs", pairs},
          {"flood_over_frobenius", flood}};
}

Json speed_json(const RelightSpeed& relight, const ThreadSpeed& speed) {
  return {{"threads", speed.threads},
          {"triad_bytes_per_second", speed.triad_bytes_per_second},
          {"relight_seconds", speed.relight_seconds},
          {"share_of_triad", relight.share_of_triad(speed)}};
}

Json relight_json(const BenchRun& run) {
  if (!run.relight) return nullptr;
  return {{"tensor", run.relight_of},
          {"tensor_bytes", run.relight->tensor_bytes},
          {"array_bytes", run.relight->array_bytes},
          {"threads", Json::array({speed_json(*run.relight, run.relight->one),
                                   speed_json(*run.relight, run.relight->all)})}};
}

}  // namespace

std::string bench_json(const BenchRun& run) {
  Json captures = Json::array(), summaries = Json::array();
  for (const BenchCapture& one : run.captures) captures.push_back(capture_json(run.plan, one));
  for (const BenchSummary& one : summarize(run)) summaries.push_back(summary_json(one));
  Json json;
  json["command"] = "bench";
  json["complete"] = run.complete();
  json["captures_planned"] = run.planned;
  json["plan"] = plan_json(run.plan);
  json["captures"] = captures;
  json["summary"] = summaries;
  json["relight"] = relight_json(run);
  return json_text(json);
}

namespace {

constexpr std::string_view kNames =
    "scene,rows,cols,channels,noise,seed,algorithm,tolerance,preset,patterns,frames,rig_seconds,host_seconds,"
    "process_seconds,merge_seconds,simulate_seconds,wall_seconds,tensor_bytes,frobenius,indirect,flood,"
    "relight_bar,relight_random,relight_natural,bar_indirect,failure,profile,light_seconds,camera_seconds,"
    "projector_seconds\n";

/// The shortest text that is read back as the same number; empty for NaN and infinity.
std::string number(double value) {
  return std::isfinite(value) ? fmt::format("{}", value) : std::string();
}

std::string csv_text(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

std::string joined(const std::vector<std::string>& fields) {
  std::string line;
  for (const std::string& field : fields) line += (line.empty() ? "" : ",") + field;
  return line;
}

std::string measured(const BenchCapture& c) {
  if (!c.done()) return std::string(15, ',');  // sixteen empty fields
  const TransportErrors& e = c.error;
  std::vector<std::string> fields{std::to_string(c.patterns), std::to_string(c.frames)};
  for (const double seconds : {c.rig_seconds, c.host_seconds(), c.process_seconds, c.merge_seconds,
                               c.simulate_seconds, c.wall_seconds})
    fields.push_back(number(seconds));
  fields.push_back(std::to_string(c.tensor_bytes));
  for (const double error :
       {e.frobenius, e.indirect, e.flood, e.relight_bar, e.relight_random, e.relight_natural, e.bar_indirect})
    fields.push_back(number(error));
  return joined(fields);
}

/// The parts of the rig's time.
std::string parts_of(const BenchCapture& c) {
  if (!c.done()) return ",,";
  return joined({number(c.rig_time.light), number(c.rig_time.camera), number(c.rig_time.projector)});
}

std::string line(const BenchPlan& plan, const BenchCapture& c) {
  const std::string tolerance = c.what.tolerance ? number(*c.what.tolerance) : std::string();
  return fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{}\n", csv_text(c.what.scene), c.what.grid.rows,
                     c.what.grid.cols, plan.channels, plan.camera_noise ? "camera" : "off", c.what.seed,
                     name(c.what.algorithm), tolerance, c.what.preset ? 1 : 0, measured(c),
                     csv_text(c.failure), c.what.profile, parts_of(c));
}

}  // namespace

std::string bench_csv(const BenchRun& run) {
  std::string text(kNames);
  for (const BenchCapture& capture : run.captures) text += line(run.plan, capture);
  return text;
}

}  // namespace symrig
