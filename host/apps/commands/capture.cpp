// SPDX-License-Identifier: Apache-2.0
#include "symrig/acquisition/capture.hpp"

#include "capture_text.hpp"
#include "command.hpp"
#include "meter.hpp"
#include "options.hpp"
#include "output.hpp"
#include "program.hpp"
#include "rig.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/text.hpp"
#include "symrig/job/capture_job.hpp"
#include "symrig/job/capture_page.hpp"
#include "symrig/job/rig_by_name.hpp"

#include <array>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <sstream>
#include <thread>
#include <utility>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

struct CaptureArguments {
  std::string rig, registration, output, json, memory, algorithm = std::string(algorithm_names().front());
  std::optional<double> tolerance, dual_threshold, max_seconds, target_error, photograph_seconds, fit_seconds;
  std::optional<std::int64_t> max_patterns;
  std::optional<int> polish;
  std::string split;
  bool dual_subtract = false, check_axis = false, unchecked = false, watch = false, cells = false;
  std::optional<int> port;
  LogOptions log;
};

constexpr const char* kCaptureExample =
    "Example:\n"
    "  symrig capture --rig 'sim:gummy?size=100x77&noise=off' -o gummy.h5 --json gummy.json\n"
    "\n"
    "{}\n"
    "During the capture, scene.h5.log keeps the photographs. After a kill, a crash or Ctrl-C, run the same "
    "command\n"
    "with --resume to continue from them. A capture that ends at a budget is complete: its tensor contains "
    "what\n"
    "the photographs show.\n";

/// A line for each algorithm with its description; long ones go on below.
std::string described_algorithms() {
  constexpr std::size_t kWidth = 108;
  std::string text = "Algorithms:\n";
  for (const AlgorithmInfo& one : algorithms()) {
    std::string line = fmt::format("  {:<7}", one.name);
    std::istringstream words{std::string(one.description)};
    for (std::string word; words >> word;) {
      if (line.size() + 1 + word.size() > kWidth) text += std::exchange(line, std::string(9, ' ')) + "\n";
      line += " " + word;
    }
    text += line + "\n";
  }
  return text;
}

Result<CaptureOptions> options_of(const CaptureArguments& arguments) {
  SYMRIG_TRY(const Algorithm algorithm, parse_algorithm(arguments.algorithm));
  if (const Result<void> given =
          check_budgets({arguments.max_patterns, arguments.max_seconds, arguments.target_error});
      !given)
    return in_command_words(given.error());
  std::optional<SplitOrder> split;
  if (!arguments.split.empty()) {
    SYMRIG_TRY(split, parse_split_order(arguments.split));
  }
  return CaptureOptions{.algorithm = algorithm,
                        .tolerance = arguments.tolerance,
                        .polish = arguments.polish,
                        .photograph_seconds = arguments.photograph_seconds,
                        .split = split,
                        .dual_threshold = arguments.dual_threshold,
                        .dual_subtracts = arguments.dual_subtract,
                        .max_patterns = arguments.max_patterns.value_or(0),
                        .max_seconds = arguments.max_seconds.value_or(0),
                        .target_error = arguments.target_error.value_or(0),
                        .unchecked = arguments.unchecked};
}

/// Compares the photographs with brute force, unless undetermined_text does.
std::string brute_force_text(Algorithm algorithm, const CaptureResult& result) {
  const std::int64_t brute = result.tensor.projector_grid().size();
  if (result.patterns <= brute && algorithm_info(algorithm).yields_to_brute_force && !result.undetermined &&
      !result.tensor.columns().empty())
    return "fewer than 64 pixels: measured by brute force, which needs no more photographs than a search\n";
  return "";
}

/// What a budget or a target has made of the tolerance.
std::string tolerance_text(const CaptureSummary& summary, const CaptureResult& result) {
  if (result.tolerance <= summary.rule.flood_fraction) return "";
  return fmt::format("coarsest tolerance {:.2g}, instead of {:.2g}\n", result.tolerance,
                     summary.rule.flood_fraction);
}

/// Facts that only some captures have: a log, a budget, an estimated error.
std::string other_facts_text(const CaptureSummary& summary, const CaptureResult& result) {
  std::string text;
  if (summary.replayed > 0)
    text += fmt::format("{} of the photographs came from the log\n",
                        grouped(static_cast<double>(summary.replayed)));
  for (const std::string& line : repair_lines(summary.trouble)) text += line + "\n";
  if (summary.camera) {
    const CameraFacts& camera = *summary.camera;
    text += fmt::format("on the camera's own pixels: {}, {}, fitted in {}\n", to_string(camera.grid),
                        byte_size(static_cast<double>(camera.bytes)), duration(camera.seconds));
  }
  if (result.undetermined) text += undetermined_text(*result.undetermined);
  text += brute_force_text(summary.algorithm, result);
  if (result.stopped_by != "done") text += fmt::format("stopped by {}\n", result.stopped_by);
  text += tolerance_text(summary, result);
  for (const std::string& warning : capture_warnings(summary, result)) text += "warning: " + warning + "\n";
  if (summary.camera && summary.camera->errors)
    text += fmt::format(
                "relative errors on the camera's own pixels, estimated from {} held-out photographs (±: "
                "{:.0f} % confidence)\n",
                result.held_out.size(), 100 * kErrorConfidence) +
            error_table(*summary.camera->errors);
  if (result.estimated)
    text += fmt::format(
                "relative errors{}, estimated from {} (±: {:.0f} % confidence)\n",
                summary.camera ? " on the projector's cells" : "",
                result.held_out.empty()
                    ? std::string("held-out photographs, before the search also used them: an upper bound")
                    : fmt::format("{} held-out photographs", result.held_out.size()),
                100 * kErrorConfidence) +
            error_table({*result.estimated, result.estimated_half_width, result.estimate_not_given});
  if (result.error_per_level.empty()) return text;
  text += "error after each level:";
  for (std::size_t k = 0; k < result.error_per_level.size(); ++k)
    text += fmt::format("{} {} ± {}", k == 0 ? "" : ",", percent(result.error_per_level[k]),
                        percent(result.error_per_level_half_width[k]));
  return text + "\n";
}

std::string result_text(const CaptureSummary& summary, const CaptureResult& result, const std::string& output,
                        const std::string& held) {
  const auto patterns = static_cast<double>(result.patterns);
  const auto brute = static_cast<double>(result.tensor.projector_grid().size());
  return fmt::format(
      "{}: {} patterns ({} frames), brute force {}; tensor {}\n"
      "capture time on the rig's clock {}{}; computing time {} ({} measuring, {} processing); peak "
      "memory {}\n"
      "{}{}",
      output, grouped(patterns), grouped(static_cast<double>(summary.cost.frames)), grouped(brute),
      byte_size(static_cast<double>(result.tensor.bytes())), duration(summary.cost.rig_seconds),
      result.forecast ? fmt::format(" (forecast {})", duration(result.forecast->rig_seconds)) : "",
      duration(summary.total_seconds), duration(summary.measure_seconds), duration(result.process_seconds),
      byte_size(static_cast<double>(summary.peak_memory_bytes)),
      held.empty() ? "" : fmt::format("{} held a scene of {}, which this one replaced\n", output, held),
      other_facts_text(summary, result));
}

CaptureJob job_of(const CaptureArguments& arguments, CaptureOptions options, std::int64_t memory,
                  const Stopwatch& watch) {
  return {.output = arguments.output,
          .log = arguments.log,
          .memory = memory,
          .json = arguments.json,
          .options = std::move(options),
          .cells_only = arguments.cells,
          .fit_seconds = arguments.fit_seconds,
          .check_axis = arguments.check_axis,
          .made = made_now,
          .watch = watch};
}

/// What a memory budget will cost; empty if the capture fits into it.
std::string memory_text(const CaptureJob& job, const OpenedRig& rig) {
  const auto settings = settings_of(job.options);
  if (job.memory == 0 || !settings) return "";
  const std::int64_t wanted = memory_wanted(*settings, rig.probe->grid(), rig.probe->channels());
  if (wanted <= job.memory) return "";
  return fmt::format("{} of memory instead of about {}: scratch files, and a longer computing time",
                     byte_size(static_cast<double>(job.memory)), byte_size(static_cast<double>(wanted)));
}

/// Captures while a line shows the progress. held: scene_to_replace().
Result<CaptureOutcome> run_with_meter(CaptureJob job, OpenedRig& rig, const std::string& held) {
  Meter meter("capture", "photographs");
  if (!held.empty())
    meter.say(fmt::format("{} holds a scene of {}; this capture will replace it", job.output, held));
  if (const std::string text = memory_text(job, rig); !text.empty()) meter.say(text);
  if (rig.registered != nullptr)
    if (const std::int64_t bytes = log_bytes_each(job, rig); bytes > 0)
      meter.say(
          fmt::format("{}.log takes {} a photograph", job.output, byte_size(static_cast<double>(bytes))));
  // The result repeats them. A person may want to stop before the light of hours.
  for (const std::string& warning : rig.trouble().warnings) meter.say("warning: " + warning);
  job.options.foretell = [&meter](const CaptureForecast& forecast) {
    meter.say(fmt::format("about {} on the rig's clock, {} photographs", duration(forecast.rig_seconds),
                          grouped(static_cast<double>(forecast.patterns))));
  };
  job.options.progress = [watched = std::move(job.options.progress),
                          shown = meter.progress()](const ProgressEvent& event) {
    if (watched) watched(event);
    return shown(event);
  };
  return run_job(job, rig);
}

/// Says where the page is. With --json - standard output belongs to the JSON.
Result<void> tell_address(const CaptureArguments& arguments, const CapturePage& page) {
  const std::string text =
      fmt::format("{}\nOpen this address in a browser of this machine to watch.\n", page.address());
  if (!is_standard_output(arguments.json)) return print(text);
  write_standard_error(text);
  return {};
}

/// The same, and serves the page: of the capture, then of its scene, until Ctrl-C.
Result<CaptureOutcome> run_with_page(const CaptureArguments& arguments, const CaptureJob& job, OpenedRig& rig,
                                     const std::string& held) {
  SYMRIG_TRY(const CapturePage page,
             CapturePage::open(rig, {.title = std::filesystem::path(arguments.output).filename().string(),
                                     .port = static_cast<std::uint16_t>(arguments.port.value_or(0)),
                                     .truth = {}}));
  SYMRIG_CHECK(tell_address(arguments, page));
  Result<CaptureOutcome> captured = run_with_meter(page.watched(job, rig), rig, held);
  if (!captured) {
    page.fail(hint_in_command_words(captured.error()).line());
    return captured;
  }
  CaptureOutcome outcome = *std::move(captured);
  page.complete(outcome);
  if (!is_standard_output(arguments.json)) {
    SYMRIG_CHECK(print(result_text(outcome.summary, outcome.result, arguments.output, held)));
    SYMRIG_CHECK(print("The page now shows the scene. Ctrl-C ends.\n"));
  }
  while (!interrupted()) std::this_thread::sleep_for(std::chrono::milliseconds(100));
  return outcome;
}

void add_log_options(CLI::App& command, LogOptions& options) {
  auto* off = command.add_flag("--no-log", options.off, "Keep no log; an interrupted capture is lost");
  command
      .add_flag("--resume", options.resume, "Continue an interrupted capture from its log, if there is one")
      ->excludes(off);
  command.add_flag("--keep-log", options.keep, "Do not delete scene.h5.log when scene.h5 is complete")
      ->excludes(off);
}

JobFiles files_of(const CaptureArguments& arguments) {
  JobFiles files = rig_files(arguments.rig);
  files.reads("the registration", arguments.registration);
  files.writes("-o", arguments.output, FileFormat::scene).writes("--json", arguments.json, FileFormat::json);
  return CaptureLog::declare(arguments.output, arguments.log, std::move(files));
}

Result<void> run(const CLI::App& command, const CaptureArguments& arguments) {
  const Stopwatch watch;
  SYMRIG_CHECK(check_effects(command, std::array{Idle{"--port", !arguments.watch, "without --watch"}}));
  if (arguments.port) SYMRIG_CHECK(check_port(*arguments.port));
  SYMRIG_TRY(const CaptureOptions options, options_of(arguments));
  if (const auto settings = settings_of(options); !settings) return in_command_words(settings.error());
  SYMRIG_CHECK(files_of(arguments).check());
  SYMRIG_TRY(const std::int64_t memory, memory_of(arguments.memory));
  const CaptureJob job = job_of(arguments, options, memory, watch);
  if (const auto free = check_job(job); !free) return hint_in_command_words(free.error());
  SYMRIG_TRY(OpenedRig rig, open_rig(arguments.rig, arguments.registration, options.max_seconds));
  if (const Result<void> fits = check_rig(options, *rig.probe); !fits) return in_command_words(fits.error());
  const std::string held = scene_to_replace(job, rig);
  const Result<CaptureOutcome> outcome =
      arguments.watch ? run_with_page(arguments, job, rig, held) : run_with_meter(job, rig, held);
  if (!outcome) return hint_in_command_words(outcome.error());
  if (is_standard_output(arguments.json) || arguments.watch) return {};
  return print(result_text(outcome->summary, outcome->result, arguments.output, held));
}

/// How exact, how many photographs, and how long.
void add_budget_options(CLI::App& command, CaptureArguments& arguments) {
  command
      .add_option("--tolerance", arguments.tolerance,
                  "Tolerance, as a share of the flood-lit RMS; a smaller one needs more patterns")
      ->type_name("X");
  command
      .add_option("--dual-threshold", arguments.dual_threshold,
                  "For dual: do not refine responses below this share of the flood-lit RMS")
      ->type_name("X");
  command.add_option("--max-patterns", arguments.max_patterns, "Stop after this many photographs")
      ->type_name("N");
  command
      .add_option("--max-seconds", arguments.max_seconds, "Stop after this many seconds on the rig's clock")
      ->type_name("S");
  command
      .add_option(
          "--target-error", arguments.target_error,
          "Stop when the estimated error of the cells plus its uncertainty is below this share; chooses the "
          "tolerance")
      ->type_name("E");
  command
      .add_option("--photograph-seconds", arguments.photograph_seconds,
                  "If exposures are planned: longest total exposure of one photograph (default: 10)")
      ->type_name("S");
  for (const char* option :
       {"--tolerance", "--dual-threshold", "--max-seconds", "--target-error", "--photograph-seconds"})
    takes_number<double>(command.get_option(option));
  takes_number<std::int64_t>(command.get_option("--max-patterns"));
}

}  // namespace

Job add_capture(CLI::App& command) {
  const auto arguments = std::make_shared<CaptureArguments>();
  command.add_option("--rig", arguments->rig, "The rig to measure with (see below)")
      ->required()
      ->type_name("RIG");
  add_registration(command, arguments->registration);
  command.add_option("-o,--output", arguments->output, "Tensor file to write (HDF5)")
      ->required()
      ->type_name("scene.h5");
  add_json(command, arguments->json);
  command.add_flag(
      "--dual-subtract", arguments->dual_subtract,
      "For dual: subtract the transport that is already stored (better than the published method)");
  takes_words(command.add_option("--algorithm", arguments->algorithm, listed(algorithm_names()))
                  ->type_name("NAME")
                  ->capture_default_str(),
              algorithm_names());
  add_budget_options(command, *arguments);
  add_log_options(command, arguments->log);
  takes_words(command
                  .add_option("--split", arguments->split,
                              "Order of several views: " + listed(split_order_names()) +
                                  " (default: by the flood-lit photograph)")
                  ->type_name("ORDER"),
              split_order_names());
  command.add_flag("--check-axis", arguments->check_axis,
                   "First check with 8 photographs that camera and projector pixels coincide");
  command.add_flag("--unchecked", arguments->unchecked,
                   "Go on where the first photographs contradict their patterns; the result may be wrong");
  command
      .add_option("--polish", arguments->polish,
                  "Most steps of a final refit of all transport to all photographs; 0: none (default: by the "
                  "algorithm)")
      ->type_name("N");
  command.add_flag("--cells", arguments->cells,
                   "Leave out the camera's own pixels, of a registered camera with more than the projector");
  command
      .add_option("--fit-seconds", arguments->fit_seconds,
                  "Most seconds that the computer takes for these; if it is too little, the log stays, and "
                  "--resume goes on "
                  "(default: no limit)")
      ->type_name("S");
  add_memory(command, arguments->memory);
  command.add_flag("--watch", arguments->watch,
                   "Serve a page that shows the capture while it runs, and its scene afterwards, until "
                   "Ctrl-C");
  add_port(command, arguments->port);
  add_progress(command);
  command.footer(fmt::format(kCaptureExample, described_algorithms()) + "\n" + rig_help() + "\n" +
                 kExitCodes);
  takes_number<int>(command.get_option("--polish"));
  return [&command, arguments] { return run(command, *arguments); };
}

}  // namespace symrig::apps
