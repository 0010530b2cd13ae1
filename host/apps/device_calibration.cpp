// SPDX-License-Identifier: Apache-2.0

#include "device_calibration.hpp"

#include "code_folder.hpp"
#include "meter.hpp"
#include "output.hpp"
#include "rig.hpp"
#include "symrig/calibration/sensor_folder.hpp"
#include "symrig/hdr/response.hpp"
#include "symrig/job/rig_by_name.hpp"
#include "symrig/projector/projector.hpp"
#include "symrig/rig/rig_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
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

namespace {

using Json = nlohmann::ordered_json;

constexpr double kGainWanted = 0.006, kReadNoiseWanted = 0.01;  // one sigma: five are 3 % and 5 %

constexpr double kFlickers = 0.01;  // rms: the linearity is then known no better
constexpr double kCurved = 0.05;    // departure from a straight line: beyond it there is a gamma

/// A measurement, and what only a rig tells.
struct Measured : MeasuredSensor {
  std::string source;
  std::optional<RigSensor> rig;  ///< its member `measured` has moved into this
};

std::int64_t defects_of(const Sensor& sensor) {
  const auto values = sensor.defects.values();
  return std::count_if(values.begin(), values.end(), [](std::uint8_t d) { return d != 0; });
}

Json sensor_json(const Sensor& sensor, bool scene) {
  const NoiseModel& noise = sensor.noise;
  return {{"bits", noise.bits()},
          {"pedestal", noise.pedestal()},
          {"gain", noise.gain()},
          {"gain_sigma", sensor.gain_sigma},
          {"read_noise", noise.read_noise()},
          {"read_noise_sigma", sensor.read_noise_sigma},
          {"full_well", noise.full_well()},
          {"clipping", noise.clipping_code()},
          {"clipping_seen", sensor.clipping_seen},
          {"prnu", scene ? Json() : Json(sensor.prnu)},
          {"dsnu", sensor.dsnu},
          {"defects", defects_of(sensor)}};
}

Json scene_json(const SceneFacts& scene) {
  const bool slope = scene.dark_levels > 1;
  return {{"lit_frames", scene.lit_frames},
          {"dark_levels", scene.dark_levels},
          {"dark_signal", slope ? Json(scene.dark_signal) : Json()},
          {"dark_signal_sigma", slope ? Json(scene.dark_signal_sigma) : Json()},
          {"drift", scene.drift},
          {"flicker", scene.flicker},
          {"clipping_seen", scene.clipping_seen}};
}

std::string to_json(const Measured& measured) {
  const SensorFindings& found = measured.findings;
  Json json{{"command", "calibrate"},
            {"source", measured.source},
            {"grid", {measured.grid.rows, measured.grid.cols}},
            {"dark_frames", measured.dark_frames},
            {"flat_levels", measured.flat_levels},
            {"sensor", found.sensor ? sensor_json(*found.sensor, found.scene.has_value()) : Json()},
            {"scene", found.scene ? scene_json(*found.scene) : Json()},
            {"linearity", Json()},
            {"response", Json()}};
  if (found.linearity)
    json["linearity"] = {{"linear", found.linearity->linear()},
                         {"worst", found.linearity->worst},
                         {"sigma", found.linearity->worst_sigma},
                         {"at_code", found.linearity->at_code}};
  if (found.response)
    json["response"] = {{"samples", found.response->samples},
                        {"repaired", found.response->repaired},
                        {"doubt", found.response_doubt},
                        {"doubtful", found.doubtful()}};
  if (measured.rig) {
    json["rig_frames"] = measured.rig->frames;
    json["rig_seconds"] = measured.rig->rig_seconds;
  }
  return json_text(json, 1);
}

/// What to do for a better measurement; empty: it is good.
std::string frames_text(const Sensor& sensor, const Measured& measured) {
  if (sensor.gain_sigma <= kGainWanted && sensor.read_noise_sigma <= kReadNoiseWanted) return "";
  if (measured.findings.scene)
    return "  not known to 3 % and 5 % (five sigmas): the sensor has few pixels, or the scene is mostly "
           "dark\n";
  const FramesNeeded needed = frames_needed(measured.grid.size(), kGainWanted, kReadNoiseWanted);
  return fmt::format("  for 3 % and 5 % (five sigmas), take {} dark frames and {} pairs at each level\n",
                     needed.dark, needed.flat_pairs);
}

std::string scene_text(const SceneFacts& scene) {
  std::string text = fmt::format("  light       changed by {} from begin to end, flickers by {} rms\n",
                                 percent(scene.drift), percent(scene.flicker));
  if (scene.dark_levels > 1)
    text += fmt::format("  dark signal {:.3g} ± {:.2g} DN/s, from dark current and stray light\n",
                        scene.dark_signal, scene.dark_signal_sigma);
  if (scene.flicker > kFlickers)
    text += fmt::format(
        "  warning: the light flickers by more than {}: if the projector's light pulses, give light_period "
        "under [rig.projector]\n",
        percent(kFlickers));
  return text;
}

std::string sensor_text(const Sensor& sensor, const Measured& measured) {
  const NoiseModel& noise = sensor.noise;
  std::string text = fmt::format(
      "  gain        {:.4g} DN/e- ± {}\n"
      "  read noise  {:.3g} e- ± {}\n"
      "  pedestal    {:.2f} DN, clipping at {} DN{}, full well {:.0f} e-\n"
      "  pixels      sensitivities {}, dark levels differ by {:.2g} DN rms; {} defects\n",
      noise.gain(), percent(sensor.gain_sigma), noise.read_noise(), percent(sensor.read_noise_sigma),
      noise.pedestal(), noise.clipping_code(), sensor.clipping_seen ? "" : " (assumed: no frame saturates)",
      noise.full_well(),
      measured.findings.scene ? "not measured (a scene is no even light)"
                              : "differ by " + percent(sensor.prnu) + " rms",
      sensor.dsnu, defects_of(sensor));
  return text + frames_text(sensor, measured);
}

std::string first_line(const Measured& measured) {
  if (measured.findings.scene)
    return fmt::format("{}: {}, {} dark frames, {} frames of a scene at {} levels\n", measured.source,
                       to_string(measured.grid), measured.dark_frames, measured.findings.scene->lit_frames,
                       measured.flat_levels);
  return fmt::format("{}: {}, {} dark frames, {} flat levels, {} exposures of a scene\n", measured.source,
                     to_string(measured.grid), measured.dark_frames, measured.flat_levels, measured.bracket);
}

std::string result_text(const Measured& measured) {
  const SensorFindings& found = measured.findings;
  std::string text = first_line(measured);
  if (found.sensor) text += sensor_text(*found.sensor, measured);
  if (found.scene) text += scene_text(*found.scene);
  if (found.linearity)
    text += fmt::format("  linearity   {}: largest deviation {} ± {} of full scale, at {:.0f} DN\n",
                        found.linearity->linear() ? "linear" : "NOT linear", percent(found.linearity->worst),
                        percent(found.linearity->worst_sigma), found.linearity->at_code);
  if (found.straight)
    text += fmt::format("  response    a straight line with a pedestal of {:.1f} DN, by the bracket alone\n",
                        found.straight->pedestal());
  else if (found.response)
    text += fmt::format(
        "  response    from {} samples, {} of {} codes made monotonic; two methods differ by {}\n",
        found.response->samples, found.response->repaired, found.response->light.size(),
        percent(found.response_doubt));
  if (found.doubtful())
    text += fmt::format(
        "  warning: the two methods may differ by {}: exposures are too dark or too far apart, or "
        "exposures, scene or lamp changed\n",
        percent(SensorFindings::kMostDoubt));
  if (measured.rig && measured.rig->defects_left_out)
    text += "  defects are not stored: camera.region is a part of the picture, so they have no place in it\n";
  if (measured.rig) text += trouble_text(measured.rig->trouble);
  return text;
}

Error not_there(const std::string& file, const std::string& what, const char* hint) {
  return {ErrorCode::bad_value, file + ": nothing to write: " + what, hint};
}

/// A camera with a gamma has no sensor.toml: noise and light would be wrong at most codes.
Result<void> check_straight(const SensorCalibration& asked, const SensorFindings& found) {
  if (asked.output.empty() || !found.scene || (found.sensor && found.linearity->linear(kCurved))) return {};
  return not_there(asked.output,
                   fmt::format("the camera is not linear, by {} of full scale at code {:.0f}",
                               percent(found.linearity->worst), found.linearity->at_code),
                   "switch its gamma off, choose a raw format, or ask for --response alone");
}

Result<void> write_files(const SensorCalibration& asked, const SensorFindings& found) {
  SYMRIG_CHECK(check_straight(asked, found));
  if (!asked.output.empty() && !found.sensor)
    return not_there(asked.output, "the folder has no dark and flat frames",
                     "name them in [sensor], or ask for --response alone");
  if (!asked.response.empty() && !found.response)
    return found.linearity ? not_there(asked.response, "the camera is linear",
                                       "remove --response: a linear camera needs none")
                           : not_there(asked.response, "the folder has no exposures of a still scene",
                                       "name them in [[sensor.bracket]]");
  if (!asked.output.empty()) SYMRIG_CHECK(save_sensor(asked.output, *found.sensor));
  if (!asked.response.empty()) SYMRIG_CHECK(save_response(asked.response, *found.response));
  return {};
}

/// The files of the job. It may replace the sensor.toml that the rig file names.
Result<void> check_files(const SensorCalibration& asked) {
  JobFiles files =
      asked.rig.empty() ? JobFiles().reads_folder("a frame", asked.folder) : rig_files(asked.rig);
  if (!asked.rig.empty()) {
    if (const auto named = sensor_file_of(asked.rig)) files.measures_anew("-o", *named);
  }
  return files.writes("-o", asked.output, FileFormat::settings)
      .writes("--response", asked.response, FileFormat::settings)
      .writes("--keep", asked.keep, FileFormat::folder)
      .writes("--json", asked.json, FileFormat::json)
      .check();
}

Result<Measured> measure(const SensorCalibration& asked) {
  Meter meter("calibrate", "frames");
  Measured measured;
  if (asked.rig.empty()) {
    SYMRIG_TRY(static_cast<MeasuredSensor&>(measured), measure_sensor_folder(asked.folder, meter.progress()));
    measured.source = folder_name(asked.folder);
    return measured;
  }
  SYMRIG_TRY(measured.rig,
             measure_rig_sensor({asked.rig, asked.keep, meter.progress(), [] { return !interrupted(); }}));
  static_cast<MeasuredSensor&>(measured) = std::move(measured.rig->measured);
  measured.source = asked.rig;
  return measured;
}

}  // namespace

Result<void> calibrate_sensor(SensorCalibration asked) {
  if (!asked.rig.empty() && asked.output.empty()) {
    SYMRIG_TRY(asked.output, sensor_file_of(asked.rig));
  }
  SYMRIG_CHECK(check_files(asked));
  SYMRIG_TRY(const Measured measured, measure(asked));
  SYMRIG_CHECK(write_files(asked, measured.findings));
  SYMRIG_CHECK(write_text(asked.json, to_json(measured)));
  return is_standard_output(asked.json) ? Result<void>() : print(result_text(measured));
}

}  // namespace symrig::apps
