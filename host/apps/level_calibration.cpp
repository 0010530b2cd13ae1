// SPDX-License-Identifier: Apache-2.0
#include "level_calibration.hpp"

#include "console.hpp"
#include "files.hpp"
#include "json_text.hpp"
#include "meter.hpp"
#include "rig.hpp"
#include "symrig/hdr/projector_response.hpp"
#include "symrig/projector/placement.hpp"
#include "symrig/rig/rig_description.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace symrig::apps {
namespace {

constexpr int kWhite = 255;
constexpr int kStep = 8;  // linear interpolation errs by (8/255)² / 8 · 2.64 = 0.03 % at a gamma of 2.2

/// The levels upwards, then downwards: this cancels a linear drift of the lamp that the drift estimate
/// leaves.
std::vector<int> levels_to_show() {
  std::vector<int> levels;
  for (int level = 0; level < kWhite; level += kStep) levels.push_back(level);
  levels.push_back(kWhite);
  const std::vector<int> up = levels;
  levels.insert(levels.end(), up.rbegin(), up.rend());
  return levels;
}

/// For each photograph: the mean over the pixels that are usable in every photograph.
std::vector<FieldLight> field_lights(const std::vector<int>& levels, const std::vector<Radiance>& fields) {
  const std::size_t values = fields.front().mean.values().size();
  std::vector<char> usable(values, 1);
  for (const Radiance& field : fields)
    for (std::size_t i = 0; i < values; ++i)
      if (field.valid.values()[i] == 0) usable[i] = 0;
  const auto count = static_cast<double>(std::count(usable.begin(), usable.end(), 1));
  std::vector<FieldLight> lights;
  for (std::size_t k = 0; k < fields.size(); ++k) {
    FieldLight light{levels[k], 0, 0};
    for (std::size_t i = 0; i < values; ++i) {
      if (usable[i] == 0) continue;
      light.light += fields[k].mean.values()[i] / count;
      light.variance += fields[k].variance.values()[i] / (count * count);
    }
    lights.push_back(light);
  }
  return lights;
}

Result<std::vector<FieldLight>> photograph_levels(Probe& rig, std::size_t together) {
  const std::vector<int> levels = levels_to_show();
  std::vector<Radiance> fields;
  Meter meter("calibrate", "photographs");
  const Progress progress = meter.progress();
  while (fields.size() < levels.size()) {
    if (!progress({"levels", std::ssize(fields), std::ssize(levels)}))
      return Error{ErrorCode::interrupted,
                   fmt::format("calibration stopped after {} photographs", fields.size()), "run it again"};
    std::vector<Pattern> patterns;
    for (std::size_t k = fields.size(); k < std::min(levels.size(), fields.size() + together); ++k)
      patterns.emplace_back(rig.grid(), 1, static_cast<float>(levels[k]) / kWhite);
    SYMRIG_TRY(std::vector<Radiance> seen, rig.measure(patterns));
    std::move(seen.begin(), seen.end(), std::back_inserter(fields));
  }
  return field_lights(levels, fields);
}

/// The level that gives half of white's light, and the gamma through that point.
struct HalfLight {
  int level = 0;
  double gamma = 1;
};

Result<HalfLight> half_light(const ProjectorResponse& response) {
  SYMRIG_TRY(const CodeTable table, CodeTable::from_light(response.curve().light));
  const int level = std::clamp(int{table.code(0.5F)}, 1, kWhite - 1);
  return HalfLight{level, std::log(response.light(level)) / std::log(static_cast<double>(level) / kWhite)};
}

std::string to_json(const std::string& rig, const std::vector<FieldLight>& fields,
                    const ProjectorResponse& response, const HalfLight& half) {
  nlohmann::ordered_json json{{"command", "calibrate"},         {"rig", rig},
                              {"photographs", fields.size()},   {"half_level", half.level},
                              {"gamma_at_half", half.gamma},    {"resolution", response.resolution()},
                              {"light", response.curve().light}};
  return json_text(json, 1);
}

std::string result_text(const std::string& rig, const std::vector<FieldLight>& fields,
                        const ProjectorResponse& response, const HalfLight& half) {
  return fmt::format(
      "{}: {} photographs of uniform fields\n"
      "  half of white's light is at level {}: a gamma of {:.3f} there\n"
      "  the largest step between two levels is {}: the error of a pattern is at most {} of white\n",
      rig, fields.size(), half.level, half.gamma, percent(2 * response.resolution()),
      percent(response.resolution()));
}

Result<void> check_uncorrected(const std::string& rig) {
  if (!is_rig_file(rig)) return {};
  SYMRIG_TRY(const RigDescription file, read_rig_file(rig, RigUse::one_pair));
  if (file.projector.levels.empty()) return {};
  return Error{ErrorCode::bad_argument,
               fmt::format("{}: the rig file already corrects its levels by {}", rig, file.projector.levels),
               "remove projector.levels from the rig file, measure, and put it back"};
}

}  // namespace

Result<void> calibrate_levels(const LevelCalibration& asked) {
  SYMRIG_CHECK(rig_files(asked.rig)
                   .writes("--levels", asked.output, FileFormat::settings)
                   .writes("--json", asked.json, FileFormat::json)
                   .check());
  SYMRIG_CHECK(check_uncorrected(asked.rig));
  SYMRIG_TRY(const OpenedRig opened, open_rig_to_calibrate(asked.rig));
  SYMRIG_TRY(const std::vector<FieldLight> fields,
             photograph_levels(*opened.probe, opened.probe->together()));
  SYMRIG_TRY(const ProjectorResponse response, ProjectorResponse::fit(fields, kWhite));
  SYMRIG_TRY(const HalfLight half, half_light(response));
  SYMRIG_CHECK(save_projector_response(asked.output, response));
  SYMRIG_CHECK(write_text(asked.json, to_json(opened.probe->describe(), fields, response, half)));
  return is_standard_output(asked.json)
             ? Result<void>()
             : print(result_text(opened.probe->describe(), fields, response, half));
}

}  // namespace symrig::apps
