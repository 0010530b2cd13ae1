// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"
#include "console.hpp"
#include "effects.hpp"
#include "error_table.hpp"
#include "files.hpp"
#include "meter.hpp"
#include "rig.hpp"
#include "symrig/acquisition/measured_errors.hpp"
#include "symrig/report/provenance.hpp"
#include "symrig/report/summary.hpp"
#include "symrig/sim/bench_truth.hpp"
#include "symrig/tensor/file.hpp"

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace symrig::apps {
namespace {

struct EvaluateArguments {
  std::string scene, rig, registration, json;
};

Error grids_differ(const TransportTensor& tensor, Grid rig, int channels) {
  return {ErrorCode::size_mismatch,
          fmt::format("the rig is {} with {} channels, the scene file {} with {}", to_string(rig), channels,
                      to_string(tensor.camera_grid()), tensor.channels()),
          "give the rig that the scene was captured from"};
}

/// Errors, and the rig's own description.
struct Judged {
  ErrorEstimate errors;
  std::string rig;
  /// If `errors` refer to T of a bench: those against T of the ideal coaxial rig.
  std::optional<ErrorEstimate> ideal = {};
};

Result<Judged> against_truth(const TransportTensor& tensor, const std::string& rig) {
  SYMRIG_TRY(const std::shared_ptr<const Scene> truth, open_truth(rig));
  const bool fits = truth->grid() == tensor.camera_grid() && truth->grid() == tensor.projector_grid() &&
                    truth->channels() == tensor.channels();
  if (!fits) return grids_differ(tensor, truth->grid(), truth->channels());
  Meter meter("evaluate", "patterns");
  SYMRIG_TRY(ErrorEstimate ideal, measure_errors(tensor, told(truth_of(truth), meter.progress())));
  SYMRIG_TRY(const SceneUri uri, parse_scene_uri(rig));
  SYMRIG_TRY(const auto bench, bench_truth(uri));
  if (!bench) return Judged{std::move(ideal), rig};
  SYMRIG_TRY(ErrorEstimate errors, measure_errors(tensor, told(*bench, meter.progress())));
  return Judged{std::move(errors), rig, std::move(ideal)};
}

/// Compares with new photographs of a real rig.
Result<Judged> against_rig(const TransportTensor& tensor, const EvaluateArguments& arguments) {
  SYMRIG_TRY(const OpenedRig opened, open_rig(arguments.rig, arguments.registration));
  SYMRIG_CHECK(check_aligned(*opened.probe));
  Probe& probe = *opened.probe;
  const bool fits = probe.grid() == tensor.camera_grid() && probe.grid() == tensor.projector_grid() &&
                    probe.channels() == tensor.channels();
  if (!fits) return grids_differ(tensor, probe.grid(), probe.channels());
  Meter meter("evaluate", "photographs");
  SYMRIG_TRY(ErrorEstimate errors, measure_errors(tensor, probe, {}, meter.progress()));
  return Judged{std::move(errors), probe.describe()};
}

Result<std::vector<HeldOutError>> against_photographs(const StoredScene& scene) {
  std::vector<HeldOutError> errors;
  for (const HeldOut& one : scene.held_out) {
    SYMRIG_TRY(HeldOutError error, held_out_error(scene.tensor, one));
    errors.push_back(std::move(error));
  }
  return errors;
}

std::string result_text(const HeldOutError& e) {
  return fmt::format(
      "held-out photograph '{}': rms error {:.4g} over {} lit pixels, {} of mean white ({:.4g})\n", e.name,
      e.rms, grouped(static_cast<double>(e.lit_pixels)), percent(e.relative()), e.mean_white);
}

std::string_view compared_with(const std::string& rig, const Judged& judged) {
  if (!is_simulated(rig)) return "new photographs";
  return judged.ideal ? "the true transport of this bench, through its exact map" : "the true transport";
}

/// Prints a warning line before the numbers.
void warn(const std::string& file, const std::vector<std::string>& differs) {
  if (differs.empty()) return;
  print_error(
      "evaluate",
      fmt::format("warning: {} was captured from another scene: {}; the errors include this difference", file,
                  fmt::join(differs, ", ")));
}

Result<void> run(const CLI::App& command, const EvaluateArguments& arguments) {
  const std::array<Idle, 2> options{{
      {"--registration", arguments.rig.empty(), "without --rig: held-out photographs are on the cells"},
      {"--registration", is_simulated(arguments.rig),
       "with a simulated rig: its truth goes through its exact map"},
  }};
  SYMRIG_CHECK(check_effects(command, options));
  SYMRIG_CHECK(rig_files(arguments.rig)
                   .reads("the scene", arguments.scene)
                   .reads("the registration", arguments.registration)
                   .writes("--json", arguments.json, FileFormat::json)
                   .check());
  SYMRIG_TRY(const StoredScene scene, load_scene(arguments.scene));
  if (arguments.rig.empty() && scene.held_out.empty())
    return Error{ErrorCode::bad_argument,
                 fmt::format("{} contains no held-out photographs to compare with", arguments.scene),
                 "give the rig that it was captured from: --rig rig.toml or --rig sim:NAME"};
  std::optional<Judged> errors;
  std::vector<std::string> differs;
  if (!arguments.rig.empty()) {
    const bool known = is_simulated(arguments.rig);
    SYMRIG_TRY(errors,
               known ? against_truth(scene.tensor, arguments.rig) : against_rig(scene.tensor, arguments));
    differs = differences_of_scene(captured_scene(scene), errors->rig);
    warn(arguments.scene, differs);
  }
  SYMRIG_TRY(const std::vector<HeldOutError> held_out, against_photographs(scene));
  SYMRIG_CHECK(write_text(
      arguments.json,
      evaluation_json(captured_scene(scene), arguments.rig, errors ? &errors->errors.value : nullptr,
                      held_out, errors ? &errors->errors.half_width : nullptr, differs,
                      errors && errors->ideal ? &errors->ideal->value : nullptr)));
  if (is_standard_output(arguments.json)) return {};
  std::string text =
      errors ? fmt::format("relative errors against {}\n", compared_with(arguments.rig, *errors)) +
                   error_table(errors->errors)
             : std::string();
  if (errors && errors->ideal)
    text +=
        "relative errors against the true transport of the ideal coaxial rig\n" + error_table(*errors->ideal);
  for (const HeldOutError& one : held_out) text += result_text(one);
  return print(text);
}

}  // namespace

Job add_evaluate(CLI::App& command) {
  const auto arguments = std::make_shared<EvaluateArguments>();
  command.add_option("scene", arguments->scene, "Tensor file of capture or fit")
      ->required()
      ->type_name("scene.h5");
  command
      .add_option("--rig", arguments->rig,
                  "Rig to compare with, simulated or real (default: held-out photographs only)")
      ->type_name("RIG");
  add_registration(command, arguments->registration);
  add_json(command, arguments->json);
  command.footer(
      std::string(
          "Example:\n"
          "  symrig evaluate scene.h5 --rig 'sim:vgroove-textured?size=64x64' --json errors.json\n"
          "\n"
          "A simulated rig compares with the truth of its scene; a real rig takes new photographs to "
          "compare with.\n"
          "Each error is |estimate - truth| / |truth|. There are several, because each of them hides some "
          "faults.\n"
          "The truth is the exact transport of the ideal coaxial rig: blurred by psf, but without noise, "
          "misalignment,\n"
          "flare or dead pixels. If the camera has pixels of its own, the truth is the exact transport\n"
          "of that bench through its exact map, and a second table compares with the ideal coaxial rig.\n"
          "Photographs that `symrig fit --hold-out` kept are compared with and without --rig.\n"
          "\n") +
      kExitCodes);
  return [&command, arguments] { return run(command, *arguments); };
}

}  // namespace symrig::apps
