// SPDX-License-Identifier: Apache-2.0
#include "report/json_text.hpp"
#include "symrig/report/bench.hpp"
#include "symrig/report/bench_summary.hpp"

#include <string_view>

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

Json reading_json(const Reading& reading) {
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

}  // namespace symrig
