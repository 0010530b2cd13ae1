// SPDX-License-Identifier: Apache-2.0
#include "symrig/acquisition/capture.hpp"

#include "capture_options.hpp"
#include "command.hpp"
#include "console.hpp"
#include "files.hpp"
#include "meter.hpp"
#include "rig.hpp"
#include "symrig/report/summary.hpp"
#include "symrig/tensor/file.hpp"

#include <chrono>
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <sys/resource.h>

namespace symrig::apps {
namespace {

using Clock = std::chrono::steady_clock;

struct Arguments {
  std::string rig, output, json, algorithm = "symrig";
  std::optional<double> tolerance, dual_threshold;
  bool dual_subtract = false;
};

constexpr const char* kExample =
    "Example:\n"
    "  symrig capture --rig 'sim:gummy?size=100x77&noise=off' -o gummy.h5 --json gummy.json\n"
    "\n"
    "Algorithms: symrig (the paper's, with noise-aware tests and a guard against energy in one child), paper "
    "(Garg et al.\n"
    "2006 as published), dual (dual photography, Sen et al. 2005: a baseline), brute (one pattern a pixel: a "
    "baseline).\n";

double since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

std::int64_t peak_memory() {
  struct rusage usage {};
  getrusage(RUSAGE_SELF, &usage);
  return std::int64_t{usage.ru_maxrss} * 1024;
}

Result<CaptureOptions> options_of(const Arguments& arguments) {
  SYMRIG_TRY(const Algorithm algorithm, parse_algorithm(arguments.algorithm));
  SYMRIG_CHECK(check_share("--tolerance", arguments.tolerance));
  SYMRIG_CHECK(check_share("--dual-threshold", arguments.dual_threshold));
  CaptureOptions options = options_for(algorithm, arguments.tolerance);
  if (arguments.dual_threshold) options.dual_threshold = *arguments.dual_threshold;
  options.dual_subtracts = arguments.dual_subtract;
  return options;
}

std::string told(const CaptureSummary& summary, const CaptureResult& result, const std::string& output) {
  const auto patterns = static_cast<double>(result.patterns);
  const auto brute = static_cast<double>(result.tensor.projector_grid().size());
  return fmt::format(
      "{}: {} patterns ({} frames) instead of {}, tensor {}\n"
      "capture time on the rig's clock {}, computed in {} ({} measuring, {} processing), peak memory {}\n",
      output, grouped(patterns), grouped(static_cast<double>(summary.cost.frames)), grouped(brute),
      byte_size(static_cast<double>(result.tensor.bytes())), duration(summary.cost.rig_seconds),
      duration(summary.total_seconds), duration(summary.measure_seconds), duration(result.process_seconds),
      byte_size(static_cast<double>(summary.peak_memory_bytes)));
}

Result<void> run(const Arguments& arguments) {
  const auto start = Clock::now();
  SYMRIG_TRY(CaptureOptions options, options_of(arguments));
  SYMRIG_CHECK(check_output(arguments.output));
  SYMRIG_CHECK(check_output(arguments.json));
  SYMRIG_TRY(const std::unique_ptr<sim::VirtualRig> rig, open_rig(arguments.rig));
  const auto capture_start = Clock::now();
  std::optional<Meter> meter(std::in_place, "capture", "photographs");
  options.progress = meter->progress();
  SYMRIG_TRY(CaptureResult result, capture(*rig, options));
  meter.reset();
  const CaptureSummary summary{.scene = rig->describe(),
                               .algorithm = options.algorithm,
                               .rule = options.rule,
                               .dual_threshold = options.dual_threshold,
                               .noise = rig->uri().camera_noise ? "camera" : "off",
                               .cost = rig->cost(),
                               .measure_seconds = since(capture_start) - result.process_seconds,
                               .total_seconds = since(start),
                               .peak_memory_bytes = peak_memory()};
  const std::string json = capture_json(summary, result);
  const std::string text = told(summary, result, arguments.output);
  SYMRIG_CHECK(save_scene(arguments.output, {std::move(result.tensor), json, {}}));
  SYMRIG_CHECK(write_text(arguments.json, json));
  return arguments.json == "-" ? Result<void>() : print(text);
}

}  // namespace

Job add_capture(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("capture", "Measure how a scene transports light, adaptively, and save the tensor");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("--rig", arguments->rig, "The rig to measure with, see below")
      ->required()
      ->type_name("RIG");
  command->add_option("-o,--output", arguments->output, "Tensor file to write (HDF5)")
      ->required()
      ->type_name("scene.h5");
  add_json(*command, arguments->json);
  command->add_flag("--dual-subtract", arguments->dual_subtract,
                    "For dual: subtract what is stored already (stronger than the published method)");
  command->add_option("--algorithm", arguments->algorithm, "symrig, paper, dual or brute")
      ->type_name("NAME")
      ->capture_default_str();
  command
      ->add_option("--tolerance", arguments->tolerance,
                   "Detail to stop at, as a share of the flood-lit RMS; smaller takes more patterns")
      ->type_name("X");
  command
      ->add_option("--dual-threshold", arguments->dual_threshold,
                   "For dual: responses below this share of the flood-lit RMS are not refined")
      ->type_name("X");
  command->footer(std::string(kExample) + "\n" + rig_help() + "\n" + kExitCodes);
  return [arguments] { return run(*arguments); };
}

}  // namespace symrig::apps
