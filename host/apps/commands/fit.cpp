// SPDX-License-Identifier: Apache-2.0
#include "code_folder.hpp"
#include "command.hpp"
#include "meter.hpp"
#include "options.hpp"
#include "output.hpp"
#include "program.hpp"
#include "symrig/base/time.hpp"
#include "symrig/report/calibration_summary.hpp"
#include "symrig/tensor/file.hpp"

#include <memory>
#include <optional>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

struct FitArguments {
  CodeFolder from;
  std::string output, json;
  std::optional<int> hold_out;
};

/// The default held-out pair: the finest column pair with stripes of at least 16 pixels and a sixteenth of
/// the projector's width. None if there is no such pair. Finer stripes would make the prediction a stronger
/// test. But the positions that its bit encodes must still be found from neighbours.
std::optional<int> default_pair(const GrayCode& code) {
  std::optional<int> chosen;
  for (int k = 0; k < code.pairs(); ++k) {
    const StripePair pair = code.pair(k);
    if (pair.axis != StripeAxis::columns || pair.stripe_width < 16 ||
        16 * pair.stripe_width < code.projector().cols)
      continue;
    if (!chosen || pair.stripe_width < code.pair(*chosen).stripe_width) chosen = k;
  }
  return chosen;
}

/// --hold-out counts from 1; 0 means no held-out pair.
Result<std::optional<int>> held_out_pair(const FitArguments& arguments, const GrayCode& code) {
  if (!arguments.hold_out) return default_pair(code);
  const int n = *arguments.hold_out;
  if (n == 0) return std::optional<int>();
  if (n >= 1 && n <= code.pairs()) return std::optional<int>(n - 1);
  return Error{ErrorCode::bad_argument, fmt::format("--hold-out {}: this sequence has no such pair", n),
               fmt::format("give 1 to {}, or 0 for no held-out pair", code.pairs())};
}

Result<std::vector<HeldOutError>> errors_of(const FirstBounceFit& fit) {
  std::vector<HeldOutError> errors;
  for (const HeldOut& one : fit.held_out) {
    SYMRIG_TRY(HeldOutError error, held_out_error(fit.tensor, one));
    errors.push_back(std::move(error));
  }
  return errors;
}

std::string result_text(const FitArguments& arguments, const FirstBounceFit& fit,
                        const std::vector<HeldOutError>& errors) {
  const FitStatistics& s = fit.statistics;
  std::string text = fmt::format(
      "{}: camera {}, projector {}, tensor {}\n"
      "lit {} of the camera's pixels, decoded {}; direct light is {} of the light there; residual "
      "{} of mean white\n",
      arguments.output, to_string(fit.tensor.camera_grid()), to_string(fit.tensor.projector_grid()),
      byte_size(static_cast<double>(fit.tensor.bytes())), percent(s.lit_share), percent(s.decoded_share),
      percent(s.direct_share), percent(s.residual));
  for (const HeldOutError& error : errors)
    text += fmt::format("held-out photograph '{}': predicted with an rms error of {} of mean white\n",
                        error.name, percent(error.relative()));
  return text;
}

Result<void> run(const FitArguments& arguments) {
  const Stopwatch watch;
  SYMRIG_CHECK(JobFiles()
                   .reads_folder("a photograph", arguments.from.folder)
                   .writes("-o", arguments.output, FileFormat::scene)
                   .writes("--json", arguments.json, FileFormat::json)
                   .check());
  std::optional<Meter> meter(std::in_place, "fit", "steps");
  SYMRIG_TRY(const CodePhotographs photographs, read_code_folder(arguments.from, meter->progress()));
  FitOptions options;
  options.decode = decode_options(arguments.from);
  SYMRIG_TRY(options.decode.held_out_pair, held_out_pair(arguments, photographs.code));
  SYMRIG_TRY(FirstBounceFit fit, fit_first_bounce(photographs, options));
  SYMRIG_TRY(const std::vector<HeldOutError> errors, errors_of(fit));
  meter.reset();
  if (interrupted())
    return Error{ErrorCode::interrupted, "stopped before the scene was written", "run it again"};
  const std::string json =
      fit_json(folder_name(arguments.from.folder), photographs, fit, errors, watch.seconds(), made_now());
  const std::string text = result_text(arguments, fit, errors);
  SYMRIG_CHECK(save_scene(arguments.output, {std::move(fit.tensor), json, std::move(fit.held_out)}));
  SYMRIG_CHECK(write_text(arguments.json, json));
  return is_standard_output(arguments.json) ? Result<void>() : print(text);
}

}  // namespace

Job add_fit(CLI::App& command) {
  const auto arguments = std::make_shared<FitArguments>();
  add_code_folder(command, arguments->from)->required();
  command.add_option("-o,--output", arguments->output, "Tensor file to write (HDF5)")
      ->required()
      ->type_name("scene.h5");
  command
      .add_option("--hold-out", arguments->hold_out,
                  "Do not use pair N in the fit, and measure how well it is predicted; 0: none (see below)")
      ->type_name("N");
  add_json(command, arguments->json);
  add_progress(command);
  command.footer(
      std::string("Example:\n"
                  "  symrig fit --from photographs -o real.h5 --json -\n"
                  "\n") +
      kCodeFolderHelp +
      "\n"
      "--hold-out counts pairs (a pattern and its complement) from 1. Default: the finest column "
      "stripes of\n"
      "at least 16 pixels and a sixteenth of the projector's width.\n"
      "\n"
      "The tensor contains direct light through the pixel map, light scattered nearby, and global "
      "light of the\n"
      "whole scene. relight, dual, inspect, evaluate and report work on it as on any other tensor.\n"
      "\n" +
      kExitCodes);
  takes_number<int>(command.get_option("--hold-out"));
  return [arguments] { return run(*arguments); };
}

}  // namespace symrig::apps
