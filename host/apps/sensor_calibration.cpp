// SPDX-License-Identifier: Apache-2.0
#include "sensor_calibration.hpp"

#include "code_folder.hpp"
#include "console.hpp"
#include "files.hpp"
#include "json_text.hpp"
#include "meter.hpp"
#include "symrig/calibration/sensor_folder.hpp"
#include "symrig/hdr/response_file.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace symrig::apps {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kGainWanted = 0.006, kReadNoiseWanted = 0.01;  // one sigma: five are 3 % and 5 %

std::int64_t defects_of(const Sensor& sensor) {
  const auto values = sensor.defects.values();
  return std::count_if(values.begin(), values.end(), [](std::uint8_t d) { return d != 0; });
}

Json sensor_json(const Sensor& sensor) {
  const NoiseModel& noise = sensor.noise;
  return {{"bits", noise.bits()},
          {"pedestal", noise.pedestal()},
          {"gain", noise.gain()},
          {"gain_sigma", sensor.gain_sigma},
          {"read_noise", noise.read_noise()},
          {"read_noise_sigma", sensor.read_noise_sigma},
          {"full_well", noise.full_well()},
          {"clipping", noise.clipping_code()},
          {"prnu", sensor.prnu},
          {"dsnu", sensor.dsnu},
          {"defects", defects_of(sensor)}};
}

std::string to_json(const SensorCalibration& asked, const SensorPhotographs& photographs,
                    const SensorFindings& found) {
  Json json{{"command", "calibrate"},
            {"source", folder_name(asked.folder)},
            {"grid", {photographs.grid.rows, photographs.grid.cols}},
            {"dark_frames", photographs.dark.size()},
            {"flat_levels", photographs.flat.size()},
            {"sensor", found.sensor ? sensor_json(*found.sensor) : Json()},
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
  return json_text(json, 1);
}

std::string sensor_text(const Sensor& sensor, const SensorPhotographs& photographs) {
  const NoiseModel& noise = sensor.noise;
  std::string text = fmt::format(
      "  gain        {:.4g} DN/e- ± {}\n"
      "  read noise  {:.3g} e- ± {}\n"
      "  pedestal    {:.2f} DN, clipping at {} DN, full well {:.0f} e-\n"
      "  pixels      sensitivities differ by {} rms, dark levels by {:.2g} DN rms; {} defects\n",
      noise.gain(), percent(sensor.gain_sigma), noise.read_noise(), percent(sensor.read_noise_sigma),
      noise.pedestal(), noise.clipping_code(), noise.full_well(), percent(sensor.prnu), sensor.dsnu,
      defects_of(sensor));
  if (sensor.gain_sigma <= kGainWanted && sensor.read_noise_sigma <= kReadNoiseWanted) return text;
  const FramesNeeded needed = frames_needed(photographs.grid.size(), kGainWanted, kReadNoiseWanted);
  return text +
         fmt::format("  for 3 % and 5 % (five sigmas), take {} dark frames and {} pairs at each level\n",
                     needed.dark, needed.flat_pairs);
}

std::string result_text(const SensorCalibration& asked, const SensorPhotographs& photographs,
                        const SensorFindings& found) {
  std::string text =
      fmt::format("{}: {}, {} dark frames, {} flat levels, {} exposures of a scene\n",
                  folder_name(asked.folder), to_string(photographs.grid), photographs.dark.size(),
                  photographs.flat.size(), photographs.bracket.size());
  if (found.sensor) text += sensor_text(*found.sensor, photographs);
  if (found.linearity)
    text += fmt::format("  linearity   {}: largest deviation {} ± {} of full scale, at {:.0f} DN\n",
                        found.linearity->linear() ? "linear" : "NOT linear", percent(found.linearity->worst),
                        percent(found.linearity->worst_sigma), found.linearity->at_code);
  if (found.response)
    text += fmt::format(
        "  response    from {} samples, {} of {} codes made monotonic; two methods differ by {}\n",
        found.response->samples, found.response->repaired, found.response->light.size(),
        percent(found.response_doubt));
  if (found.doubtful())
    text += fmt::format(
        "  warning: the two methods may differ by {}: the stated exposures, the scene or the lamp changed\n",
        percent(SensorFindings::kMostDoubt));
  return text;
}

Error not_there(const std::string& file, const char* what, const char* hint) {
  return {ErrorCode::bad_value, file + ": nothing to write: " + what, hint};
}

Result<void> write_files(const SensorCalibration& asked, const SensorFindings& found) {
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

}  // namespace

Result<void> calibrate_sensor(const SensorCalibration& asked) {
  SYMRIG_CHECK(JobFiles()
                   .reads_folder("a frame", asked.folder)
                   .writes("-o", asked.output, FileFormat::settings)
                   .writes("--response", asked.response, FileFormat::settings)
                   .writes("--json", asked.json, FileFormat::json)
                   .check());
  Meter meter("calibrate", "frames");
  SYMRIG_TRY(const SensorPhotographs photographs, read_sensor_folder(asked.folder, meter.progress()));
  SYMRIG_TRY(const SensorFindings found, examine_sensor(photographs));
  SYMRIG_CHECK(write_files(asked, found));
  SYMRIG_CHECK(write_text(asked.json, to_json(asked, photographs, found)));
  return is_standard_output(asked.json) ? Result<void>() : print(result_text(asked, photographs, found));
}

}  // namespace symrig::apps
