// SPDX-License-Identifier: Apache-2.0
#include "capture_text.hpp"
#include "command.hpp"
#include "meter.hpp"
#include "options.hpp"
#include "output.hpp"
#include "rig.hpp"
#include "symrig/job/evaluation.hpp"
#include "symrig/report/summary.hpp"
#include "symrig/tensor/file.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

struct EvaluateArguments {
  std::string scene, rig, registration, json, memory;
};

/// On the cells, and on the camera's own pixels if the scene has them.
struct JudgedScene {
  Judged cells;
  std::optional<ErrorEstimate> camera;
};

/// The cells are judged all the same if the camera's pixels cannot be.
Result<std::optional<ErrorEstimate>> or_warning(Result<ErrorEstimate> camera) {
  if (camera) return std::optional(*std::move(camera));
  const Error& error = camera.error();
  if (error.code != ErrorCode::size_mismatch && error.code != ErrorCode::bad_argument) return error;
  print_error("evaluate", fmt::format("warning: the camera's own pixels are not compared: {}; {}", error.what,
                                      error.hint));
  return std::optional<ErrorEstimate>();
}

/// A real rig takes new photographs.
Result<JudgedScene> against(const OpenedScene& opened, const EvaluateArguments& arguments) {
  const CameraTransport* camera = opened.scene.camera.get();
  JudgedScene judged;
  if (is_simulated(arguments.rig)) {
    Meter meter("evaluate", "patterns");
    SYMRIG_TRY(judged.cells, judge_by_truth(*opened.transport, arguments.rig, meter.progress()));
    // A scene of a bench may be compared with another, ideal rig.
    if (camera == nullptr || !judged.cells.ideal) return judged;
    SYMRIG_TRY(judged.camera, or_warning(judge_camera_by_truth(*camera, arguments.rig, meter.progress())));
    return judged;
  }
  SYMRIG_TRY(const OpenedRig rig, open_rig(arguments.rig, arguments.registration));
  Meter meter("evaluate", "photographs");
  SYMRIG_TRY(judged.cells, judge_by_rig(*opened.transport, *rig.probe, meter.progress()));
  if (camera == nullptr || rig.registered == nullptr) return judged;
  SYMRIG_TRY(judged.camera, or_warning(judge_camera_by_rig(*camera, *rig.registered, meter.progress())));
  return judged;
}

/// How many held-out photographs there are, and the one that is predicted worst. All are in the JSON.
std::string result_text(const std::vector<HeldOutError>& held_out) {
  if (held_out.empty()) return "";
  const HeldOutError& e = *std::ranges::max_element(held_out, {}, &HeldOutError::relative);
  const std::string which =
      held_out.size() == 1 ? fmt::format("held-out photograph '{}'", e.name)
                           : fmt::format("{} held-out photographs; the worst, '{}'", held_out.size(), e.name);
  return fmt::format("{}: rms error {:.4g} over {} lit pixels, {} of mean white ({:.4g})\n", which, e.rms,
                     grouped(static_cast<double>(e.lit_pixels)), percent(e.relative()), e.mean_white);
}

std::string_view compared_with(const std::string& rig, const Judged& judged) {
  if (!is_simulated(rig)) return "new photographs";
  return judged.ideal ? "the true transport of this bench, through its exact map" : "the true transport";
}

Result<void> run(const CLI::App& command, const EvaluateArguments& arguments, const OpenScene& open) {
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
  SYMRIG_TRY(const std::int64_t memory, memory_of(arguments.memory));
  SYMRIG_TRY(const OpenedScene opened, open(arguments.scene, {.memory = memory}));
  const StoredScene& scene = opened.scene;
  if (arguments.rig.empty() && scene.held_out.empty())
    return Error{ErrorCode::bad_argument,
                 fmt::format("{} contains no held-out photographs to compare with", arguments.scene),
                 "give the rig that it was captured from: --rig rig.toml or --rig sim:NAME"};
  std::optional<Judged> errors;
  std::optional<ErrorEstimate> camera;
  std::vector<std::string> differs;
  if (!arguments.rig.empty()) {
    SYMRIG_TRY(JudgedScene judged, against(opened, arguments));
    errors = std::move(judged.cells);
    camera = std::move(judged.camera);
    differs = differences_of_scene(captured_scene(scene), errors->rig);
    if (const std::string warning = other_scene_warning(arguments.scene, differs); !warning.empty())
      print_error("evaluate", "warning: " + warning);
  }
  SYMRIG_TRY(const std::vector<HeldOutError> held_out,
             judge_by_photographs(*opened.transport, scene.held_out));
  SYMRIG_CHECK(write_text(
      arguments.json,
      evaluation_json(captured_scene(scene), arguments.rig, errors ? &errors->errors.value : nullptr,
                      held_out, errors ? &errors->errors.half_width : nullptr, differs,
                      errors && errors->ideal ? &errors->ideal->value : nullptr,
                      camera ? &*camera : nullptr)));
  if (is_standard_output(arguments.json)) return {};
  std::string text;
  if (camera)
    text +=
        fmt::format("relative errors on the camera's own pixels, against {}\n",
                    is_simulated(arguments.rig) ? "the true transport of this bench" : "new photographs") +
        error_table(*camera);
  if (errors)
    text += fmt::format("relative errors{} against {}\n", camera ? " on the projector's cells," : "",
                        compared_with(arguments.rig, *errors)) +
            error_table(errors->errors);
  if (errors && errors->ideal)
    text +=
        "relative errors against the true transport of the ideal coaxial rig\n" + error_table(*errors->ideal);
  return print(text + result_text(held_out));
}

}  // namespace

Job add_evaluate(CLI::App& command) {
  return add_evaluate_of(command, open_here);
}

Job add_evaluate_of(CLI::App& command, OpenScene open) {
  const auto arguments = std::make_shared<EvaluateArguments>();
  command.add_option("scene", arguments->scene, "Tensor file of capture or fit")
      ->required()
      ->type_name("scene.h5");
  add_memory(command, arguments->memory);
  command
      .add_option("--rig", arguments->rig,
                  "Rig to compare with, simulated or real (default: held-out photographs only)")
      ->type_name("RIG");
  add_registration(command, arguments->registration);
  add_json(command, arguments->json);
  add_progress(command);
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
  return [&command, arguments, open = std::move(open)] { return run(command, *arguments, open); };
}

}  // namespace symrig::apps
