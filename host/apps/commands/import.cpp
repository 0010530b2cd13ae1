// SPDX-License-Identifier: Apache-2.0
#include "capture_text.hpp"
#include "command.hpp"
#include "meter.hpp"
#include "options.hpp"
#include "output.hpp"
#include "program.hpp"
#include "rig.hpp"
#include "symrig/base/text.hpp"
#include "symrig/job/dense_file.hpp"

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace symrig::apps {
namespace {

struct ImportArguments {
  std::string matrix, grid, views, output, json, algorithm = std::string(algorithm_names().front());
  std::optional<double> tolerance;
};

std::string rig_of(const ImportArguments& arguments) {
  std::string rig = "dense:" + arguments.matrix;
  if (!arguments.grid.empty()) rig += "?grid=" + arguments.grid;
  if (!arguments.views.empty()) rig += (arguments.grid.empty() ? "?views=" : "&views=") + arguments.views;
  return rig;
}

Result<CaptureOptions> options_of(const ImportArguments& arguments) {
  SYMRIG_TRY(const Algorithm algorithm, parse_algorithm(arguments.algorithm));
  CaptureOptions options{.algorithm = algorithm, .tolerance = arguments.tolerance};
  if (const auto settings = settings_of(options); !settings) return in_command_words(settings.error());
  return options;
}

/// The facts of the capture, and the errors against the matrix.
std::string json_of(const ImportOutcome& outcome, const std::string& rig) {
  auto facts = nlohmann::ordered_json::parse(outcome.capture.json);
  facts["command"] = "import";
  facts["matrix_bytes"] = outcome.matrix_bytes;
  const std::string judged = evaluation_json(rig, rig, &outcome.judged.errors.value, {});
  facts["error"] = nlohmann::ordered_json::parse(judged).at("error");
  return json_text(facts, 2);
}

std::string import_text(const ImportArguments& arguments, const ImportOutcome& outcome) {
  const CaptureResult& result = outcome.capture.result;
  const auto bytes = static_cast<double>(result.tensor.bytes());
  return fmt::format(
             "{}: {} pixels, {} products of T; tensor {}, {:.3g} times smaller than the matrix ({})\n",
             arguments.output, to_string(result.tensor.projector_grid()),
             grouped(static_cast<double>(result.patterns)), byte_size(bytes), outcome.matrix_bytes / bytes,
             byte_size(outcome.matrix_bytes)) +
         "relative errors against the matrix\n" + error_table(outcome.judged.errors);
}

Result<ImportOutcome> import_with_meter(CaptureJob job, OpenedRig& rig) {
  Meter meter("import", "products");
  job.options.progress = meter.progress();
  return import_matrix(std::move(job), rig);
}

Result<void> run(const ImportArguments& arguments) {
  SYMRIG_TRY(CaptureOptions options, options_of(arguments));
  SYMRIG_CHECK(JobFiles()
                   .reads("the matrix", arguments.matrix)
                   .writes("-o", arguments.output, FileFormat::scene)
                   .writes("--json", arguments.json, FileFormat::json)
                   .check());
  const std::string name = rig_of(arguments);
  SYMRIG_TRY(OpenedRig rig, open_rig(name, ""));
  CaptureJob job{
      .output = arguments.output, .log = {.off = true}, .options = std::move(options), .made = made_now};
  const Result<ImportOutcome> outcome = import_with_meter(std::move(job), rig);
  if (!outcome) return hint_in_command_words(outcome.error());
  SYMRIG_CHECK(write_text(arguments.json, json_of(*outcome, name)));
  if (is_standard_output(arguments.json)) return {};
  return print(import_text(arguments, *outcome));
}

}  // namespace

Job add_import(CLI::App& command) {
  const auto arguments = std::make_shared<ImportArguments>();
  command.add_option("matrix", arguments->matrix, "T as a matrix: .npy, .mat or HDF5")
      ->required()
      ->type_name("T.npy");
  command.add_option("-o,--output", arguments->output, "Tensor file to write (HDF5)")
      ->required()
      ->type_name("scene.h5");
  command
      .add_option("--grid", arguments->grid,
                  "Rows and columns of the picture (default: as the file states it, or a square)")
      ->type_name("ROWSxCOLUMNS");
  command
      .add_option("--views", arguments->views,
                  "Rows and columns of the views that tile the picture (default: one view)")
      ->type_name("VxW");
  command.add_option("--algorithm", arguments->algorithm, listed(algorithm_names()))
      ->type_name("NAME")
      ->capture_default_str();
  command
      .add_option("--tolerance", arguments->tolerance,
                  "Tolerance, as a share of the flood-lit RMS; a smaller one gives a larger tensor")
      ->type_name("X");
  add_json(command, arguments->json);
  add_progress(command);
  command.footer(
      std::string(
          "Example:\n"
          "  symrig import T.npy --grid 48x64 -o scene.h5\n"
          "\n"
          "Measures the matrix as `symrig capture --rig dense:T.npy` does, and compares the tensor "
          "with it.\n"
          "A matrix that is not data-sparse is refused, with the evidence: its tensor would be no smaller. "
          "--algorithm brute\n"
          "stores it nevertheless.\n"
          "\n") +
      kExitCodes);
  takes_number<double>(command.get_option("--tolerance"));
  return [arguments] { return run(*arguments); };
}

}  // namespace symrig::apps
