// SPDX-License-Identifier: Apache-2.0
// merge: a bracket of photographs becomes radiance.
#include "command.hpp"
#include "meter.hpp"
#include "options.hpp"
#include "output.hpp"
#include "program.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/calibration/sensor_folder.hpp"
#include "symrig/hdr/response.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace symrig::apps {
namespace {

struct MergeArguments {
  std::string folder, output, variance, valid, sensor, response, json;
  bool unchecked = false;
};

Result<KnownCamera> camera_of(const MergeArguments& arguments) {
  KnownCamera known;
  if (!arguments.sensor.empty()) {
    SYMRIG_TRY(known.sensor, load_sensor(arguments.sensor));
  }
  if (!arguments.response.empty()) {
    SYMRIG_TRY(known.response, load_response(arguments.response));
  }
  return known;
}

double valid_share(const MergedBracket& merged) {
  const auto valid = merged.radiance.valid.values();
  return static_cast<double>(std::count(valid.begin(), valid.end(), 1)) / static_cast<double>(valid.size());
}

/// The median of σ / mean where there is light.
double relative_noise(const MergedBracket& merged) {
  std::vector<float> shares;
  const auto mean = merged.radiance.mean.values(), variance = merged.radiance.variance.values();
  for (std::size_t i = 0; i < mean.size(); ++i)
    if (merged.radiance.valid.values()[i] != 0 && mean[i] > 0)
      shares.push_back(std::sqrt(variance[i]) / mean[i]);
  return shares.empty() ? 0 : static_cast<double>(median(shares));
}

const char* method_of(const MergedBracket& merged, const MergeArguments& arguments) {
  if (merged.camera.straight) return "a straight line that the bracket shows";
  if (!merged.camera.response) return "a linear sensor";
  return arguments.response.empty() ? "a response curve recovered from the bracket"
                                    : "the given response curve";
}

std::string to_json(const MergeArguments& arguments, const SensorPhotographs& photographs,
                    const MergedBracket& merged) {
  using Object = nlohmann::ordered_json;
  Object frames = Object::array(), ratios = Object::array();
  for (const SensorPhotographs::Still& still : photographs.bracket)
    frames.push_back({{"file", still.file}, {"exposure", seconds(still.exposure)}});
  for (const ExposureRatio& ratio : merged.ratios)
    ratios.push_back({{"shorter", photographs.bracket[ratio.shorter].file},
                      {"longer", photographs.bracket[ratio.longer].file},
                      {"stated", ratio.stated},
                      {"seen", ratio.seen},
                      {"sigma", ratio.sigma * ratio.seen},
                      {"wrong", ratio.wrong()}});
  const Object json{{"command", "merge"},
                    {"source", folder_name(arguments.folder)},
                    {"grid", {photographs.grid.rows, photographs.grid.cols}},
                    {"channels", photographs.channels},
                    {"frames", frames},
                    {"linear", !merged.camera.response.has_value()},
                    {"units", merged.units},
                    {"valid_share", valid_share(merged)},
                    {"relative_noise", relative_noise(merged)},
                    {"response_doubt", merged.camera.response_doubt},
                    {"ratios", ratios},
                    {"warnings", merged.warnings}};
  return json_text(json, 1);
}

std::string result_text(const MergeArguments& arguments, const SensorPhotographs& photographs,
                        const MergedBracket& merged) {
  return fmt::format(
      "{}: {}, {} channel{}, {} exposures, by {}\n{} of the values are valid; noise {} of a value (median)\n",
      arguments.output, to_string(photographs.grid), photographs.channels,
      photographs.channels == 1 ? "" : "s", photographs.bracket.size(), method_of(merged, arguments),
      percent(valid_share(merged)), percent(relative_noise(merged)));
}

/// 1 where a value is valid.
Image<float> flags_of(const Image<std::uint8_t>& valid) {
  Image<float> flags(valid.grid(), valid.channels());
  std::transform(valid.values().begin(), valid.values().end(), flags.values().begin(),
                 [](std::uint8_t v) { return v != 0 ? 1.F : 0.F; });
  return flags;
}

Result<void> write_pictures(const MergeArguments& arguments, const MergedBracket& merged) {
  const double exposure = automatic_exposure(merged.radiance.mean);
  const PictureFacts facts{.units = merged.units, .exposure = exposure, .view = "camera"};
  SYMRIG_CHECK(write_picture(arguments.output, merged.radiance.mean, exposure, facts));
  if (!arguments.variance.empty()) {
    const PictureFacts squared{.units = std::string("square of ") + merged.units};
    SYMRIG_CHECK(write_picture(arguments.variance, merged.radiance.variance, 1, squared));
  }
  if (arguments.valid.empty()) return {};
  return write_picture(arguments.valid, flags_of(merged.radiance.valid), 1, {});
}

Result<void> check_variance_suffix(const std::string& path) {
  if (path.empty() || !is_png(path)) return {};
  return Error{ErrorCode::bad_argument, path + ": a PNG cannot hold a variance", "give .exr or .pfm"};
}

Result<void> run(const MergeArguments& arguments) {
  for (const std::string* path : {&arguments.output, &arguments.variance, &arguments.valid})
    if (!path->empty()) SYMRIG_CHECK(check_picture_suffix(*path));
  SYMRIG_CHECK(check_variance_suffix(arguments.variance));
  SYMRIG_CHECK(JobFiles()
                   .reads_folder("a photograph", arguments.folder)
                   .reads("--sensor", arguments.sensor)
                   .reads("--response", arguments.response)
                   .writes("-o", arguments.output, FileFormat::picture)
                   .writes("--variance", arguments.variance, FileFormat::picture)
                   .writes("--valid", arguments.valid, FileFormat::picture)
                   .writes("--json", arguments.json, FileFormat::json)
                   .check());
  SYMRIG_TRY(KnownCamera known, camera_of(arguments));
  std::optional<Meter> meter(std::in_place, "merge", "photographs");
  SYMRIG_TRY(const BracketFolder read,
             read_bracket_folder(arguments.folder, std::move(known), meter->progress()));
  const SensorPhotographs& photographs = read.photographs;
  SYMRIG_TRY(const MergedBracket merged,
             merge_bracket(photographs, read.camera, {.unchecked = arguments.unchecked}));
  meter.reset();
  if (interrupted())
    return Error{ErrorCode::interrupted, "stopped before the pictures were written", "run it again"};
  SYMRIG_CHECK(write_pictures(arguments, merged));
  for (const std::string& warning : merged.warnings) print_error("merge", "warning: " + warning);
  SYMRIG_CHECK(write_text(arguments.json, to_json(arguments, photographs, merged)));
  return is_standard_output(arguments.json) ? Result<void>()
                                            : print(result_text(arguments, photographs, merged));
}

}  // namespace

Job add_merge(CLI::App& command) {
  const auto arguments = std::make_shared<MergeArguments>();
  command.add_option("folder", arguments->folder, "Folder of the photographs, with a capture.toml")
      ->required()
      ->type_name("DIR");
  command.add_option("-o,--output", arguments->output, "Radiance to write: .exr, .pfm, or .png to look at")
      ->required()
      ->type_name("radiance.exr");
  command.add_option("--variance", arguments->variance, "Variance of the radiance to write: .exr or .pfm")
      ->type_name("FILE");
  command.add_option("--valid", arguments->valid, "Picture to write: white where a value is valid")
      ->type_name("FILE");
  CLI::Option* const sensor =
      command
          .add_option("--sensor", arguments->sensor, "The camera is linear: its noise, by symrig calibrate")
          ->type_name("sensor.toml");
  command
      .add_option("--response", arguments->response,
                  "The camera is not linear: its curve, by symrig calibrate")
      ->type_name("response.toml")
      ->excludes(sensor);
  command.add_flag(
      "--unchecked", arguments->unchecked,
      "Merge photographs even if they contradict their exposures or each other; the result may be wrong");
  add_json(command, arguments->json);
  add_progress(command);
  command.footer(
      std::string(
          "Example:\n"
          "  symrig merge photographs -o radiance.exr --variance variance.exr\n"
          "\n"
          "capture.toml names the photographs of a still scene with their exposures, and the bits of a "
          "code:\n"
          "  symrig = 1\n"
          "  [sensor]\n"
          "  bits = 8\n"
          "  [[sensor.bracket]]\n"
          "  file = \"a.png\"\n"
          "  exposure = \"4 ms\"\n"
          "\n"
          "With dark and flat frames there, or with --sensor, the camera counts as linear, and the unit is "
          "electrons per\n"
          "second. Otherwise 1 is the light that gives the largest code in one second. The bracket then "
          "shows "
          "whether the\n"
          "camera is linear. If not, its response curve is recovered, unless --response gives it.\n"
          "\n"
          "Frames that symrig calibrate --sensor --rig kept measure the camera and are merged too.\n"
          "Exposures that contradict the photographs are refused, or named in a warning if it is by little.\n"
          "\n") +
      kExitCodes);
  return [arguments] { return run(*arguments); };
}

}  // namespace symrig::apps
