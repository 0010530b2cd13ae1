// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/summary.hpp"

#include "symrig/report/internal/json_text.hpp"
#include "symrig/report/text.hpp"

#include <algorithm>

namespace symrig {
namespace {

using report::grid_json;
using report::Json;
using report::json_text;
using report::leaves_json;

Json rule_json(const RankRule& rule) {
  return {{"signal_fraction", rule.signal_fraction},
          {"flood_fraction", rule.flood_fraction},
          {"empty_fraction", rule.empty_fraction},
          {"noise_sigmas", rule.noise_sigmas},
          {"concentration", rule.concentration}};
}

Json economy_json(const Economy& economy) {
  return {{"decay", economy.decay},
          {"risk", economy.risk},
          {"largest_risk", economy.largest_risk},
          {"dominance", economy.dominance},
          {"diagonal_spread", economy.diagonal_spread},
          {"checks", economy.checks},
          {"check_share", economy.check_share},
          {"direct_share", economy.direct_share}};
}

Json stated_errors_json(const TransportErrors& errors) {
  return {
      {"frobenius", errors.frobenius},
      {"indirect", errors.indirect},
      {"flood", errors.flood},
      {"relight",
       {{"bar", errors.relight_bar}, {"random", errors.relight_random}, {"natural", errors.relight_natural}}},
      {"bar_indirect", errors.bar_indirect}};
}

/// Half of the interval around each error. NaN is null.
Json uncertainty_json(const TransportErrors& half_width) {
  Json json = stated_errors_json(half_width);
  json["confidence"] = kErrorConfidence;
  return json;
}

Json not_given_json(const std::vector<ErrorNotGiven>& all) {
  Json json = Json::object();
  for (const ErrorNotGiven& one : all) json[one.key] = one.reason;
  return json;
}

Json noise_check_json(const NoiseCheck& check) {
  return {{"variance_ratio", check.variance_ratio},
          {"shared_ratio", check.shared_ratio},
          {"neighbours", check.neighbours},
          {"lamp", check.lamp},
          {"findings", check.findings}};
}

/// Largest rank and how many leaves have each rank.
Json ranks_json(const TransportTensor& tensor) {
  std::vector<std::int64_t> count;
  for (const Leaf& leaf : tensor.leaves()) {
    const std::size_t rank = leaf.rank;
    if (rank >= count.size()) count.resize(rank + 1);
    ++count[rank];
  }
  return count;
}

Json steps_json(const std::vector<CaptureStep>& steps) {
  Json list = Json::array();
  for (const CaptureStep& step : steps)
    list.push_back({{"level", step.level},
                    {"patterns", step.patterns},
                    {"rig_seconds", step.rig_seconds},
                    {"error", step.error ? Json(*step.error) : Json(nullptr)}});
  return list;
}

/// Results of the search about the transport.
Json search_json(const CaptureResult& result) {
  if (!result.undetermined) return {{"undetermined", nullptr}};
  const Undetermined& found = *result.undetermined;
  Json levels = Json::array();
  for (const LevelEvidence& level : found.levels)
    levels.push_back({{"level", level.level},
                      {"patterns", level.patterns},
                      {"tested", level.tested},
                      {"leaves", level.leaves},
                      {"unexplained", level.unexplained}});
  return {{"undetermined",
           {{"reason", found.reason},
            {"patterns", found.patterns},
            {"forecast", found.forecast},
            {"brute_force", found.brute_force},
            {"completed", found.completed},
            {"levels", levels}}}};
}

/// What went wrong with frames and devices, and was repaired.
Json trouble_json(const RigTrouble& trouble) {
  Json frames{{"missing", trouble.frames.missing}};
  for (std::size_t k = 0; k < FrameCounts::kVerdicts; ++k)
    frames[std::string(name(static_cast<Verdict>(k)))] = trouble.frames.by_verdict[k];
  return {{"photographs_retaken", trouble.retaken},
          {"frames", frames},
          {"triggers_unanswered", trouble.unanswered},
          {"exposures_unasked", trouble.unasked},
          {"runs_spoiled", trouble.spoiled_runs},
          {"patterns_late", trouble.patterns_late},
          {"planes_doubtful", trouble.planes_doubtful},
          {"registered_again", trouble.registered_again},
          {"exposures", trouble.exposures},
          {"warnings", trouble.warnings},
          {"reopened",
           {{"board", trouble.boards_reopened},
            {"camera", trouble.cameras_reopened},
            {"projector", trouble.projectors_reopened}}}};
}

Json camera_json(const CaptureSummary& summary) {
  if (!summary.camera) return nullptr;
  const CameraFacts& camera = *summary.camera;
  Json json{{"grid", grid_json(camera.grid)},      {"rows", camera.rows},
            {"coefficients", camera.coefficients}, {"bytes", camera.bytes},
            {"seconds", camera.seconds},           {"unjudged", camera.unjudged}};
  json["estimated_error"] = camera.errors ? stated_errors_json(camera.errors->value) : Json(nullptr);
  json["estimated_error_uncertainty"] =
      camera.errors ? uncertainty_json(camera.errors->half_width) : Json(nullptr);
  json["estimated_error_not_given"] =
      not_given_json(camera.errors ? camera.errors->not_given : std::vector<ErrorNotGiven>());
  return json;
}

}  // namespace

std::vector<std::string> rig_warnings(const RigTrouble& trouble) {
  std::vector<std::string> all;
  if (!trouble.exposures.empty())
    all.push_back(fmt::format(
        "exposure times and pixel values do not match: {}; check exposure_offset, the strobe line and the "
        "camera's linearity",
        trouble.exposures));
  all.insert(all.end(), trouble.warnings.begin(), trouble.warnings.end());
  return all;
}

std::vector<std::string> capture_warnings(const CaptureSummary& summary, const CaptureResult& result) {
  using text::grouped, text::percent;
  std::vector<std::string> all = rig_warnings(summary.trouble);
  if (const std::int64_t brute = result.tensor.projector_grid().size(); result.patterns > brute)
    all.push_back(fmt::format("{} photographs more than brute force needs; algorithm symrig never takes more",
                              grouped(static_cast<double>(result.patterns - brute))));
  if (!result.estimated && default_economy(summary.algorithm).checks && result.stopped_by != "done")
    all.push_back(
        fmt::format("{} ended the capture before photographs could be held out, so none of its errors "
                    "is known; give more",
                    result.stopped_by));
  const bool missed = summary.target_error > 0 && result.stated_error().value_or(0) > summary.target_error;
  if (missed && result.stopped_by == "done")
    all.push_back(fmt::format(
        "estimated error and uncertainty are above the target of {}; a smaller tolerance may help",
        percent(summary.target_error)));
  if (!summary.camera_missing.empty())
    all.push_back("pictures have the projector's cells, not the camera's pixels: " + summary.camera_missing);
  if (summary.camera && summary.camera->unjudged > 0)
    all.push_back(
        fmt::format("{} of {} rows of camera pixels are partly a guess: their pixels are dead, or clipped "
                    "where they are lit; expose for less, or calibrate again if the scene has changed",
                    grouped(static_cast<double>(summary.camera->unjudged)),
                    grouped(static_cast<double>(summary.camera->rows))));
  if (result.suspects > 0 && !(result.undetermined && result.undetermined->completed))
    all.push_back(
        fmt::format("held-out photographs find {} leaves wrong that could not be split; the estimated errors "
                    "contain them",
                    result.suspects));
  for (const std::string& finding : result.noise_check.findings)
    all.push_back(finding + "; estimated errors and rank tests rely on the stated noise");
  if (result.gain_mismatch.found)
    all.push_back(fmt::format(
        "by reciprocity, the camera's gain differs from the projector's by {} rms over the picture; the "
        "estimated errors contain it; calibrate the rig (symrig calibrate), or give both the same vignetting",
        percent(result.gain_mismatch.rms)));
  return all;
}

std::string capture_json(const CaptureSummary& summary, const CaptureResult& result) {
  const TransportTensor& tensor = result.tensor;
  const auto bytes = static_cast<double>(tensor.bytes());
  Json json;
  json["command"] = "capture";
  json["scene"] = summary.scene;
  json["grid"] = grid_json(tensor.projector_grid());
  json["channels"] = tensor.channels();
  json["algorithm"] = name(summary.algorithm);
  json["rule"] = rule_json(summary.rule);
  if (summary.algorithm == Algorithm::dual) json["dual_threshold"] = summary.dual_threshold;
  json["patterns"] = result.patterns;
  json["frames"] = summary.cost.frames;
  json["replayed"] = summary.replayed;
  json["stopped_by"] = result.stopped_by;
  json["estimated_error"] = result.estimated ? stated_errors_json(*result.estimated) : Json(nullptr);
  json["estimated_error_uncertainty"] =
      result.estimated ? uncertainty_json(result.estimated_half_width) : Json(nullptr);
  json["estimated_error_not_given"] = not_given_json(result.estimate_not_given);
  json["error_per_level"] = result.error_per_level;
  json["steps"] = steps_json(result.steps);
  json["error_per_level_uncertainty"] = result.error_per_level_half_width;
  json["noise_check"] = noise_check_json(result.noise_check);
  const GainMismatch& gain = result.gain_mismatch;
  json["gain_mismatch"] = {
      {"found", gain.found}, {"rms", gain.rms}, {"sigma", gain.sigma}, {"shape", gain.shape}};
  json["suspects"] = result.suspects;
  json["search"] = search_json(result);
  json["split"] = name(tensor.camera_tree().split());
  json["patterns_brute_force"] = tensor.projector_grid().size();
  json["patterns_per_level"] = result.patterns_per_level;
  json["leaves_per_level"] = leaves_json(tensor);
  json["tensor_bytes"] = tensor.bytes();
  json["dense_bytes"] = tensor.dense_bytes();
  json["compression"] = bytes > 0 ? tensor.dense_bytes() / bytes : 0.0;
  json["seconds"] = {
      {"measure", summary.measure_seconds},  {"process", result.process_seconds - result.refine_seconds},
      {"refine", result.refine_seconds},     {"total", summary.total_seconds},
      {"merge", summary.cost.merge_seconds}, {"simulate", summary.cost.simulate_seconds}};
  json["rig_seconds"] = summary.cost.rig_seconds;
  json["forecast"] = result.forecast ? Json{{"patterns", result.forecast->patterns},
                                            {"rig_seconds", result.forecast->rig_seconds}}
                                     : Json();
  json["tolerance_coarsest"] = result.tolerance > 0 ? Json(result.tolerance) : Json();
  json["peak_memory_bytes"] = summary.peak_memory_bytes;
  json["camera"] = camera_json(summary);
  if (!summary.camera_missing.empty()) json["camera_missing"] = summary.camera_missing;
  json["noise"] = summary.noise;
  json["trouble"] = trouble_json(summary.trouble);
  report::add_made(json, summary.made);
  return json_text(json);
}

LogIdentity log_identity(const Probe& rig, const CaptureSettings& settings) {
  const bool any = settings.max_patterns > 0 || settings.max_seconds > 0 || settings.target_error > 0;
  return {rig.grid(),
          rig.channels(),
          rig.identity(),
          settings_text(settings),
          {settings.max_patterns, settings.max_seconds, any}};
}

std::string settings_text(const CaptureSettings& settings) {
  Json json{{"algorithm", name(settings.algorithm)},
            {"rule", rule_json(settings.rule)},
            {"economy", economy_json(settings.economy)}};
  // Exposures do not change the choice of patterns, but photographs with two kinds of exposures must not be
  // mixed in one capture.
  const ExposureGoal usual;
  if (settings.exposure.longest_seconds != usual.longest_seconds)
    json["photograph_seconds"] = settings.exposure.longest_seconds;
  // A camera's own pixels want finer ones than its cells.
  if (settings.exposure.relative != usual.relative) json["exposure_relative"] = settings.exposure.relative;
  if (settings.split) json["split"] = name(*settings.split);
  if (settings.algorithm == Algorithm::dual)
    json.update({{"dual_threshold", settings.dual_threshold}, {"dual_subtracts", settings.dual_subtracts}});
  const Json flat = json.flatten();
  std::string text;
  for (const auto& [path, value] : flat.items()) {
    std::string key = path.substr(1);
    std::replace(key.begin(), key.end(), '/', '.');
    text += key + " " + (value.is_string() ? value.get<std::string>() : value.dump()) + "\n";
  }
  return text;
}

std::string evaluation_json(const std::string& scene, const std::string& rig, const TransportErrors* errors,
                            const std::vector<HeldOutError>& held_out, const TransportErrors* half_width,
                            const std::vector<std::string>& differs, const TransportErrors* ideal,
                            const ErrorEstimate* camera) {
  Json json;
  json["command"] = "evaluate";
  json["scene"] = scene;
  json["rig"] = rig.empty() ? Json(nullptr) : Json(rig);
  json["rig_differs"] = differs;
  if (errors != nullptr) json["error"] = stated_errors_json(*errors);
  if (ideal != nullptr) json["error_ideal"] = stated_errors_json(*ideal);
  if (half_width != nullptr) json["error_uncertainty"] = uncertainty_json(*half_width);
  if (camera != nullptr)
    json["camera"] = {{"error", stated_errors_json(camera->value)},
                      {"error_uncertainty", uncertainty_json(camera->half_width)}};
  json["held_out"] = report::held_out_json(held_out);
  return json_text(json);
}

std::string rig_errors_json(const std::string& rig, const TransportErrors& errors,
                            const TransportErrors& half_width, const TransportErrors* ideal) {
  Json json;
  json["rig"] = rig;
  json["error"] = stated_errors_json(errors);
  if (ideal != nullptr) json["error_ideal"] = stated_errors_json(*ideal);
  json["error_uncertainty"] = uncertainty_json(half_width);
  return json_text(json);
}

std::string stored_errors_json(const StoredScene& scene, const std::vector<HeldOutError>& held_out) {
  const report::CaptureFacts facts(scene.capture_json);
  Json json;
  for (const char* key : {"estimated_error", "estimated_error_uncertainty", "estimated_error_not_given"}) {
    const nlohmann::json* const found = facts.find((std::string("/") + key).c_str());
    json[key] = found == nullptr ? Json(nullptr) : Json(*found);
  }
  json["held_out"] = report::held_out_json(held_out);
  return json_text(json);
}

std::string inspection_json(const StoredScene& scene) {
  const TransportTensor& tensor = scene.tensor;
  Json subdivided = Json::array();
  for (const NodeCounts& level : node_counts(tensor)) subdivided.push_back(level.subdivided);
  Json json;
  json["command"] = "inspect";
  json["camera_grid"] = grid_json(tensor.camera_grid());
  json["projector_grid"] = grid_json(tensor.projector_grid());
  json["channels"] = tensor.channels();
  json["symmetric"] = tensor.symmetric();
  json["levels"] = tensor.leaves_per_level().size();
  json["leaves"] = tensor.leaves().size();
  json["scalars"] = tensor.scalar_count();
  json["column_entries"] = tensor.column_rows().size();
  json["leaves_per_level"] = leaves_json(tensor);
  json["subdivided_per_level"] = subdivided;
  json["leaves_of_rank"] = ranks_json(tensor);
  json["tensor_bytes"] = tensor.bytes();
  json["dense_bytes"] = tensor.dense_bytes();
  json["held_out"] = scene.held_out.size();
  json["camera"] = nullptr;
  if (scene.camera)
    json["camera"] = {{"grid", grid_json(scene.camera->camera_grid())},
                      {"rows", scene.camera->rows()},
                      {"coefficients", scene.camera->coefficients()},
                      {"bytes", scene.camera->bytes()},
                      {"mosaic", scene.camera->parts().mosaic}};
  json["capture"] = report::CaptureFacts(scene.capture_json).json();
  return json_text(json);
}

std::string captured_scene(const StoredScene& scene) {
  return report::CaptureFacts(scene.capture_json).text("/scene").value_or("");
}

std::string missing_pixels(const StoredScene& scene) {
  return report::CaptureFacts(scene.capture_json).text("/camera_missing").value_or("");
}

}  // namespace symrig
