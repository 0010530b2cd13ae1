// SPDX-License-Identifier: Apache-2.0

#include "code_folder.hpp"
#include "command.hpp"
#include "device_calibration.hpp"
#include "meter.hpp"
#include "options.hpp"
#include "output.hpp"
#include "program.hpp"
#include "rig.hpp"
#include "symrig/base/result.hpp"
#include "symrig/calibration/pixel_map.hpp"
#include "symrig/calibration/registration.hpp"
#include "symrig/image/file.hpp"
#include "symrig/image/image.hpp"
#include "symrig/report/calibration_summary.hpp"
#include "symrig/rig/rig_file.hpp"

#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>

#include <fmt/format.h>

namespace symrig::apps {

namespace {

/// `symrig calibrate --rig` of a camera with pixels of its own.
struct RegistrationJob {
  std::string output, report, json;  ///< files to write; empty: none
};

std::string next_step(const std::string& output) {
  if (output.empty()) return "nothing was kept: give -o registration.h5\n";
  return fmt::format("wrote {}; `symrig capture --registration {}` uses it\n", output, output);
}

/// Registers the rig's camera, writes the files, and prints the result.
/// fails: as register_camera and save_registration.
Result<void> register_rig(Probe& rig, const RegistrationJob& job) {
  std::optional<Meter> meter(std::in_place, "calibrate", "photographs");
  RegistrationOptions options;
  options.progress = meter->progress();
  SYMRIG_TRY(const Registration found, register_camera(rig, options));
  meter.reset();
  SYMRIG_TRY(const CellWeights weights, found.weights());
  const RegistrationSummary summary{found, weights, rig.cost().rig_seconds, made_now(), rig.views()};
  if (!job.output.empty()) SYMRIG_CHECK(save_registration(job.output, found));
  if (!job.report.empty()) {
    SYMRIG_TRY(const std::string page, registration_page(summary));
    SYMRIG_CHECK(write_text(job.report, page));
  }
  SYMRIG_CHECK(write_text(job.json, registration_json(summary)));
  if (is_standard_output(job.json)) return {};
  return print(registration_text(summary) + next_step(job.output));
}

struct CalibrateArguments {
  CodeFolder from;
  std::string rig, levels, sensor, keep, response, output, uncertainty, report, json;
  bool measures_sensor = false;  // --sensor, with or without a folder
};

/// The result of a calibration, from photographs or from a rig.
struct Calibration {
  CalibrationSummary summary;
  PixelMap map;
};

Result<Calibration> from_folder(const CodeFolder& from) {
  Meter meter("calibrate", "photographs");
  SYMRIG_TRY(const CodePhotographs photographs, read_code_folder(from, meter.progress()));
  SYMRIG_TRY(PixelMap map, decode(photographs, decode_options(from)));
  Calibration calibration{summarize(folder_name(from.folder), photographs, map), std::move(map)};
  // A map of a few pixels has no smooth model; the map itself is good.
  if (auto smooth = fit_smooth_map(calibration.map)) calibration.summary.smooth = *std::move(smooth);
  return calibration;
}

/// Shows the sequence with the rig and takes one photograph for each pattern. white: the flood-lit photograph
/// with its variance.
Result<CodePhotographs> photograph_code(Probe& rig, Radiance& white) {
  CodePhotographs photographs{GrayCode(rig.grid()), {}, {}};
  const std::vector<Pattern> patterns = gray_code_patterns(rig.grid());
  Meter meter("calibrate", "photographs");
  const Progress progress = meter.progress();
  for (std::size_t k = 0; k < patterns.size(); ++k) {
    if (!progress({"Gray code", static_cast<std::int64_t>(k), static_cast<std::int64_t>(patterns.size()),
                   kNoneToCome}))
      return Error{ErrorCode::interrupted, fmt::format("calibration stopped after {} photographs", k),
                   "run it again"};
    SYMRIG_TRY(std::vector<Radiance> seen, rig.measure(std::span(patterns).subspan(k, 1)));
    photographs.names.push_back(fmt::format("pattern {}", k));
    photographs.images.push_back(to_gray(seen.front().mean));
    if (static_cast<int>(k) == photographs.code.white()) white = std::move(seen.front());
  }
  return photographs;
}

RigSummary rig_summary(const PixelMap& map, const Radiance& white, const ProbeCost& cost) {
  RigSummary summary = offsets_of(map);
  summary.rig_seconds = cost.rig_seconds;
  double variance = 0, valid = 0;
  for (std::size_t i = 0; i < white.valid.values().size(); ++i) {
    if (white.valid.values()[i] == 0) continue;
    variance += white.variance.values()[i];
    ++valid;
  }
  const auto all = static_cast<double>(white.valid.values().size());
  summary.invalid_share = all > 0 ? 1 - valid / all : 0;
  summary.predicted_noise = valid > 0 ? std::sqrt(variance / valid) : 0;
  return summary;
}

Result<Calibration> from_rig(Probe& rig) {
  Radiance white;
  SYMRIG_TRY(const CodePhotographs photographs, photograph_code(rig, white));
  SYMRIG_CHECK(check_gray_code(photographs));
  SYMRIG_TRY(PixelMap map, decode(photographs));
  Calibration calibration{summarize(rig.describe(), photographs, map), std::move(map)};
  calibration.summary.rig = rig_summary(calibration.map, white, rig.cost());
  return calibration;
}

std::string smooth_text(const SmoothMap& smooth) {
  return fmt::format(
      "smooth model of {} {}: left-out pixels on planar parts ({} of them) are {:.3f} pixels rms from it; {} "
      "of "
      "the decoded pixels are marked as edges\n",
      smooth.pieces, smooth.pieces == 1 ? "piece" : "pieces", percent(smooth.held_out.planar_share),
      smooth.held_out.rms, percent(smooth.edge_share));
}

std::string calibration_text(const Calibration& c) {
  std::string text = fmt::format(
      "{}: {} photographs, camera {}, projector {}\n"
      "decoded {} of the camera's pixels, {} of the lit ones; {} of these are outliers (over 1.5 "
      "pixels from their neighbours' map), rms of the others {:.3f} pixels\n"
      "mean white {:.4g}, mean black {:.4g}, noise {:.3g} rms a pixel (in units of the photographs)\n",
      c.summary.source, c.summary.photographs, to_string(c.map.camera), to_string(c.map.projector),
      percent(c.map.decoded_share()), percent(c.summary.quality.valid_share),
      percent(c.summary.quality.outlier_share), c.summary.quality.rms, c.summary.mean_white,
      c.summary.mean_black, c.map.noise);
  if (c.map.axes != CodeAxes::both)
    text += c.map.axes == CodeAxes::columns ? "only columns are known: the sequence has no pairs of rows\n"
                                            : "only rows are known: the sequence has no pairs of columns\n";
  if (c.summary.smooth) text += smooth_text(*c.summary.smooth);
  if (!c.summary.rig) return text;
  const RigSummary& rig = *c.summary.rig;
  // Positions of a camera with pixels of its own are in other units than those of the projector.
  if (c.map.camera == c.map.projector)
    text += fmt::format(
        "projector - camera position: rows {:+.3f}, columns {:+.3f} pixels (rms deviation from this mean "
        "{:.3f})\n",
        rig.offset_row, rig.offset_col, rig.offset_rms);
  return text +
         fmt::format(
             "noise of the flood-lit photograph as the rig predicts it: {:.3g}; {} of its values are not "
             "usable\n",
             rig.predicted_noise, percent(rig.invalid_share));
}

/// Refuses options that have no effect with the chosen kind of calibration.
Result<void> check_calibrate_effects(const CLI::App& command, const CalibrateArguments& arguments) {
  const bool sensor = arguments.measures_sensor, folder = !arguments.from.folder.empty();
  const std::array<Idle, 3> options{{
      {"--projector", !folder, "without --from: a rig knows its projector's size"},
      {"--uncertainty", sensor, "with --sensor, which measures no map"},
      {"--report", sensor, "with --sensor, which measures no map"},
  }};
  return check_effects(command, options);
}

bool is_registration(const std::string& output) {
  return output.ends_with(".h5");
}

Result<void> check_arguments(const CalibrateArguments& arguments) {
  const int given = !arguments.from.folder.empty() + !arguments.rig.empty() + !arguments.sensor.empty();
  if (arguments.measures_sensor && given == 0)
    return Error{ErrorCode::bad_argument, "--sensor is empty",
                 "give its folder of frames, or --rig RIG to take them"};
  if (!arguments.sensor.empty() && !arguments.rig.empty())
    return Error{ErrorCode::bad_argument, "--sensor DIR takes its frames from a folder, not from --rig",
                 "remove DIR, or --rig"};
  if (given != 1 || (arguments.measures_sensor && !arguments.from.folder.empty()))
    return Error{ErrorCode::bad_argument, "give exactly one of --from, --rig and --sensor",
                 "see symrig calibrate --help"};
  if (!arguments.measures_sensor && !arguments.response.empty())
    return Error{ErrorCode::bad_argument, "--response needs --sensor", "see symrig calibrate --help"};
  if (!arguments.keep.empty() && (!arguments.measures_sensor || arguments.rig.empty()))
    return Error{ErrorCode::bad_argument, "--keep needs --sensor and --rig", "see symrig calibrate --help"};
  if (arguments.measures_sensor && !arguments.levels.empty())
    return Error{ErrorCode::bad_argument, "--sensor and --levels are two measurements",
                 "measure one after the other"};
  if (arguments.from.folder.empty() && (arguments.from.unchecked || arguments.from.mirrored))
    return Error{ErrorCode::bad_argument,
                 fmt::format("--{} needs --from", arguments.from.unchecked ? "unchecked" : "mirrored"),
                 "see symrig calibrate --help"};
  if (arguments.rig.empty() && !arguments.levels.empty())
    return Error{ErrorCode::bad_argument, "--levels needs --rig", "see symrig calibrate --help"};
  if (!arguments.levels.empty() && !(arguments.output + arguments.uncertainty + arguments.report).empty())
    return Error{ErrorCode::bad_argument, "--levels measures no map",
                 "remove -o, --uncertainty and --report"};
  if (arguments.measures_sensor) return {};
  if (arguments.rig.empty() && is_registration(arguments.output))
    return Error{ErrorCode::bad_argument, fmt::format("{}: a registration needs --rig", arguments.output),
                 "give --rig RIG, or a map: -o map.exr"};
  for (const std::string& picture : {arguments.output, arguments.uncertainty}) {
    if (picture.empty() || is_registration(picture)) continue;
    if (is_png(picture))
      return Error{ErrorCode::bad_argument,
                   fmt::format("{}: PNG cannot store the positions of a map", picture),
                   "give a name that ends in .exr or .pfm"};
    SYMRIG_CHECK(check_picture_suffix(picture));
  }
  return {};
}

/// The file for the result: as given, else the one that the rig file names.
Result<std::string> output_of(const CalibrateArguments& arguments) {
  if (!arguments.output.empty() || arguments.rig.empty() || !is_rig_file(arguments.rig))
    return arguments.output;
  SYMRIG_TRY(const RigDescription file, read_rig_file(arguments.rig, RigUse::one_pair));
  return file.registration.empty() ? file.map : file.registration;
}

/// The files of the calibration. It may replace the result that the rig file names.
JobFiles files_of(const CalibrateArguments& arguments, const std::string& output) {
  JobFiles files = rig_files(arguments.rig);
  files.reads_folder("a photograph", arguments.from.folder)
      .writes("-o", output, is_registration(output) ? FileFormat::registration : FileFormat::map)
      .writes("--uncertainty", arguments.uncertainty, FileFormat::map)
      .writes("--report", arguments.report, FileFormat::page)
      .writes("--json", arguments.json, FileFormat::json);
  if (arguments.rig.empty() || !is_rig_file(arguments.rig)) return files;
  if (const auto rig = read_rig_file(arguments.rig, RigUse::one_pair))
    files.measures_anew("-o", rig->map).measures_anew("-o", rig->registration);
  return files;
}

Result<void> write_map(const CalibrateArguments& arguments, const std::string& output,
                       const Calibration& found) {
  if (!output.empty()) SYMRIG_CHECK(write_image(output, map_picture(found.map)));
  if (!arguments.uncertainty.empty())
    SYMRIG_CHECK(write_image(arguments.uncertainty, uncertainty_picture(found.map)));
  if (!arguments.report.empty())
    SYMRIG_CHECK(write_text(arguments.report, calibration_page(found.summary, found.map)));
  SYMRIG_CHECK(write_text(arguments.json, calibration_json(found.summary, found.map)));
  return is_standard_output(arguments.json) ? Result<void>() : print(calibration_text(found));
}

/// A camera with pixels of its own is registered, unless a map is asked for.
Result<void> calibrate_rig(const CalibrateArguments& arguments, const std::string& output) {
  SYMRIG_TRY(const OpenedRig opened, open_rig_to_calibrate(arguments.rig));
  Probe& rig = *opened.probe;
  const bool own_pixels = rig.grid() != rig.camera_grid();
  const bool map_asked = !(arguments.uncertainty + output).empty() && !is_registration(output);
  if (is_registration(output) || (own_pixels && !map_asked)) {
    if (!arguments.uncertainty.empty())
      return Error{ErrorCode::bad_argument, "--uncertainty is of a map, but a registration is measured",
                   "remove --uncertainty, or give -o map.exr"};
    return register_rig(rig, {output, arguments.report, arguments.json});
  }
  SYMRIG_TRY(const Calibration found, from_rig(rig));
  return write_map(arguments, output, found);
}

Result<void> run(const CLI::App& command, const CalibrateArguments& arguments) {
  SYMRIG_CHECK(check_arguments(arguments));
  SYMRIG_CHECK(check_calibrate_effects(command, arguments));
  if (arguments.measures_sensor)
    return calibrate_sensor({arguments.sensor, arguments.rig, arguments.keep, arguments.output,
                             arguments.response, arguments.json});
  if (!arguments.levels.empty()) return calibrate_levels({arguments.rig, arguments.levels, arguments.json});
  SYMRIG_TRY(const std::string output, output_of(arguments));
  SYMRIG_CHECK(files_of(arguments, output).check());
  if (!arguments.rig.empty()) return calibrate_rig(arguments, output);
  SYMRIG_TRY(const Calibration found, from_folder(arguments.from));
  return write_map(arguments, output, found);
}

}  // namespace

Job add_calibrate(CLI::App& command) {
  const auto arguments = std::make_shared<CalibrateArguments>();
  add_code_folder(command, arguments->from);
  command
      .add_option("--rig", arguments->rig, "Instead of a folder: measure this rig with a Gray-code sequence")
      ->type_name("RIG");
  command
      .add_option("--levels", arguments->levels,
                  "With --rig: measure the light of the projector's levels instead, and write this file")
      ->type_name("levels.toml");
  command
      .add_option("--sensor", arguments->sensor,
                  "Measure a camera's sensor instead: folder of dark and flat frames with capture.toml; "
                  "without DIR, the rig of --rig takes the frames")
      ->type_name("DIR")
      ->expected(0, 1);
  command
      .add_option("--keep", arguments->keep,
                  "With --sensor and --rig: also write the frames to this new folder, with a capture.toml")
      ->type_name("FOLDER");
  command
      .add_option("--response", arguments->response,
                  "With --sensor, for a camera that is not linear: response curve to write")
      ->type_name("response.toml");
  command
      .add_option("-o,--output", arguments->output,
                  "Map (.exr or .pfm) or registration (.h5) to write; with --sensor: sensor.toml")
      ->type_name("FILE");
  command
      .add_option(
          "--uncertainty", arguments->uncertainty,
          "Picture to write (.exr or .pfm): sigma of column and row, distance from the neighbours' map")
      ->type_name("sigma.exr");
  command.add_option("--report", arguments->report, "HTML page to write: the map and its quality")
      ->type_name("map.html");
  add_json(command, arguments->json);
  add_progress(command);
  command.footer(
      std::string(
          "Example:\n"
          "  symrig calibrate --from photographs -o map.exr --json -\n"
          "  symrig calibrate --rig 'sim:plane?misalign=0.5'\n"
          "  symrig calibrate --rig 'sim:plane?size=64x64&camera=304x304&turn=1.5&zoom=0.78' -o "
          "registration.h5\n"
          "  symrig calibrate --rig rig.toml --levels levels.toml\n"
          "  symrig calibrate --sensor --rig rig.toml -o sensor.toml\n"
          "  symrig calibrate --sensor frames -o sensor.toml\n"
          "\n"
          "If the camera has pixels of its own, --rig finds where they look on the projector's cells. "
          "A capture needs\n"
          "this registration.\n"
          "The channels of a map are projector column, projector row, and decoded (1 or 0).\n\n") +
      kCodeFolderHelp + "\n" + rig_help() + "\n" + kExitCodes);
  return [&command, arguments] {
    arguments->measures_sensor = command.count("--sensor") > 0;
    return run(command, *arguments);
  };
}

}  // namespace symrig::apps
