// SPDX-License-Identifier: Apache-2.0
#include "symrig/acquisition/capture.hpp"

#include "capture_log.hpp"
#include "capture_options.hpp"
#include "command.hpp"
#include "console.hpp"
#include "error_table.hpp"
#include "files.hpp"
#include "guarded.hpp"
#include "invocation.hpp"
#include "meter.hpp"
#include "numbers.hpp"
#include "rig.hpp"
#include "symrig/base/nearest_name.hpp"
#include "symrig/base/stopwatch.hpp"
#include "symrig/calibration/coaxial_check.hpp"
#include "symrig/report/summary.hpp"
#include "symrig/tensor/file.hpp"

#include <memory>
#include <optional>
#include <sstream>
#include <utility>

#include <fmt/format.h>
#include <sys/resource.h>

namespace symrig::apps {
namespace {

struct CaptureArguments {
  std::string rig, registration, output, json, algorithm = std::string(algorithm_names().front());
  std::optional<double> tolerance, dual_threshold, max_seconds, target_error, photograph_seconds;
  std::optional<std::int64_t> max_patterns;
  std::optional<int> polish;
  std::string split;
  bool dual_subtract = false, check_axis = false;
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

std::int64_t peak_memory() {
  struct rusage usage {};
  getrusage(RUSAGE_SELF, &usage);
  return std::int64_t{usage.ru_maxrss} * 1024;
}

/// Refuses a budget of 0, because 0 means no budget in the library.
Result<void> check_budgets_given(const CaptureArguments& arguments) {
  const auto none = [](const char* option, const char* next) {
    return Error{ErrorCode::bad_argument, fmt::format("{} 0 allows no measurement", option), next};
  };
  if (arguments.max_patterns == 0) return none("--max-patterns", "give 1 or more");
  if (arguments.max_seconds == 0.0) return none("--max-seconds", "give seconds, such as 3600");
  if (arguments.target_error == 0.0) return none("--target-error", "give a number above 0, such as 0.02");
  return {};
}

Result<CaptureOptions> options_of(const CaptureArguments& arguments) {
  SYMRIG_TRY(const Algorithm algorithm, parse_algorithm(arguments.algorithm));
  SYMRIG_CHECK(check_budgets_given(arguments));
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
                        .target_error = arguments.target_error.value_or(0)};
}

/// Why a search gave up, and what the capture did instead.
std::string search_text(const Undetermined& found) {
  std::string text = fmt::format(
      "the transport is not data-sparse: {} (the search would need at least {} photographs, brute "
      "force {})\n",
      found.reason, grouped(static_cast<double>(found.forecast)),
      grouped(static_cast<double>(found.brute_force)));
  for (const LevelEvidence& level : found.levels)
    if (level.tested > 0)
      text += fmt::format("  level {}: {} of {} nodes are leaves; {} of their energy is unexplained\n",
                          level.level, grouped(static_cast<double>(level.leaves)),
                          grouped(static_cast<double>(level.tested)), percent(level.unexplained));
  return text +
         (found.completed
              ? fmt::format("  brute force measured the rest after {} photographs\n",
                            grouped(static_cast<double>(found.patterns)))
              : "  a budget or the memory limit does not allow brute force: the search went on within it\n");
}

/// Compares the photographs with brute force, unless search_text does.
std::string brute_force_text(Algorithm algorithm, const CaptureResult& result) {
  const std::int64_t brute = result.tensor.projector_grid().size();
  if (result.patterns > brute)
    return fmt::format(
        "warning: {} photographs more than brute force needs; --algorithm symrig never takes more\n",
        grouped(static_cast<double>(result.patterns - brute)));
  if (algorithm_info(algorithm).yields_to_brute_force && !result.undetermined &&
      !result.tensor.columns().empty())
    return "fewer than 64 pixels: measured by brute force, which needs no more photographs than a search\n";
  return "";
}

/// Facts that only some captures have: a log, a budget, an estimated error.
std::string other_facts_text(const CaptureSummary& summary, const CaptureResult& result) {
  std::string text;
  if (summary.replayed > 0)
    text += fmt::format("{} of the photographs came from the log\n",
                        grouped(static_cast<double>(summary.replayed)));
  text += trouble_text(summary.trouble);
  if (result.undetermined) text += search_text(*result.undetermined);
  text += brute_force_text(summary.algorithm, result);
  if (result.stopped_by != "done") text += fmt::format("stopped by {}\n", result.stopped_by);
  if (result.suspects > 0 && !(result.undetermined && result.undetermined->completed))
    text += fmt::format(
        "warning: held-out photographs find {} leaves wrong that could not be split; the estimated errors "
        "contain them\n",
        result.suspects);
  for (const std::string& finding : result.noise_check.findings)
    text += fmt::format("warning: {}; estimated errors and rank tests rely on the stated noise\n", finding);
  if (result.gain_mismatch.found)
    text += fmt::format(
        "warning: by reciprocity, the camera's gain differs from the projector's by {} rms over the picture; "
        "the estimated errors contain it; calibrate the rig (symrig calibrate), or give both the same "
        "vignetting\n",
        percent(result.gain_mismatch.rms));
  if (result.estimated)
    text += fmt::format(
                "relative errors, estimated from {} (±: {:.0f} % confidence)\n",
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

std::string result_text(const CaptureSummary& summary, const CaptureResult& result,
                        const std::string& output) {
  const auto patterns = static_cast<double>(result.patterns);
  const auto brute = static_cast<double>(result.tensor.projector_grid().size());
  return fmt::format(
      "{}: {} patterns ({} frames), brute force {}; tensor {}\n"
      "capture time on the rig's clock {}; computing time {} ({} measuring, {} processing); peak "
      "memory {}\n"
      "{}",
      output, grouped(patterns), grouped(static_cast<double>(summary.cost.frames)), grouped(brute),
      byte_size(static_cast<double>(result.tensor.bytes())), duration(summary.cost.rig_seconds),
      duration(summary.total_seconds), duration(summary.measure_seconds), duration(result.process_seconds),
      byte_size(static_cast<double>(summary.peak_memory_bytes)), other_facts_text(summary, result));
}

struct Measured {
  CaptureSummary summary;
  CaptureResult result;
};

/// Runs the capture on a rig, through the log if there is one.
Result<Measured> measure(OpenedRig& opened, CaptureOptions options, CaptureLog& log) {
  const Stopwatch watch;
  Probe& rig = *opened.probe;
  std::optional<LoggedProbe> logged;
  if (log.log() != nullptr) logged.emplace(rig, *log.log(), rig.together());
  Probe& probe = logged ? static_cast<Probe&>(*logged) : rig;
  options.log = log.log();
  SYMRIG_TRY(const CaptureSettings settings, settings_of(options));
  auto result = capture(probe, options);
  if (!result) return result.error();
  if (opened.registered != nullptr) SYMRIG_CHECK(opened.registered->check_motion());
  const CaptureSummary summary{.scene = rig.describe(),
                               .algorithm = settings.algorithm,
                               .rule = settings.rule,
                               .dual_threshold = settings.dual_threshold,
                               .noise = opened.noise,
                               .cost = probe.cost(),
                               .measure_seconds = watch.seconds() - result->process_seconds,
                               .peak_memory_bytes = peak_memory(),
                               .replayed = logged ? logged->replayed() : 0,
                               .trouble = opened.trouble(),
                               .made = made_now()};
  return Measured{summary, *std::move(result)};
}

Result<void> save(const CaptureArguments& arguments, Measured measured, const std::string& json) {
  CaptureResult& result = measured.result;
  SYMRIG_CHECK(save_scene(arguments.output, {std::move(result.tensor), json, std::move(result.held_out)}));
  return write_text(arguments.json, json);
}

Result<void> check_axis(Probe& rig) {
  Result<void> checked = require_coaxial(rig);
  if (checked || checked.error().code != ErrorCode::bad_value) return checked;
  Error error = checked.error();
  error.hint += ", or capture without --check-axis";
  return error;
}

/// The algorithms that use the symmetry of T need a coaxial rig.
Result<void> check_symmetric(const OpenedRig& opened, Algorithm algorithm) {
  if (opened.coaxial || algorithm == Algorithm::brute || algorithm == Algorithm::dual) return {};
  Error error = opened.coaxial.error();
  error.hint += ", or capture with --algorithm brute or dual";
  return error;
}

/// Captures and saves everything to the disk. Returns the text to print.
Result<std::string> measure_and_save(const CaptureArguments& arguments, CaptureOptions options,
                                     OpenedRig& opened, CaptureLog& log, const Stopwatch& watch) {
  std::optional<Meter> meter(std::in_place, "capture", "photographs");
  options.progress = meter->progress();
  SYMRIG_TRY(Measured measured, measure(opened, options, log));
  meter.reset();
  measured.summary.total_seconds = watch.seconds();
  const std::string json = capture_json(measured.summary, measured.result);
  std::string text = result_text(measured.summary, measured.result, arguments.output);
  SYMRIG_CHECK(save(arguments, std::move(measured), json));
  return text;
}

JobFiles files_of(const CaptureArguments& arguments) {
  JobFiles files = rig_files(arguments.rig);
  files.reads("the registration", arguments.registration);
  files.writes("-o", arguments.output, FileFormat::scene).writes("--json", arguments.json, FileFormat::json);
  return CaptureLog::declare(arguments.output, arguments.log, std::move(files));
}

Result<void> run(const CaptureArguments& arguments) {
  const Stopwatch watch;
  SYMRIG_TRY(const CaptureOptions options, options_of(arguments));
  const Result<CaptureSettings> settings = settings_of(options);
  if (!settings) return in_command_words(settings.error());
  SYMRIG_CHECK(files_of(arguments).check());
  SYMRIG_CHECK(CaptureLog::check(arguments.output, arguments.log));
  SYMRIG_TRY(OpenedRig opened, open_rig(arguments.rig, arguments.registration));
  const std::unique_ptr<Probe>& rig = opened.probe;
  if (const Result<void> fits = check_rig(options, *rig); !fits) return in_command_words(fits.error());
  SYMRIG_CHECK(check_symmetric(opened, settings->algorithm));
  if (arguments.check_axis && !CaptureLog::goes_on(arguments.output, arguments.log))
    SYMRIG_CHECK(check_axis(*rig));
  SYMRIG_TRY(CaptureLog log,
             CaptureLog::open(arguments.output, arguments.log, log_identity(*rig, *settings)));
  const Result<std::string> text =
      guarded([&] { return measure_and_save(arguments, options, opened, log, watch); });
  if (!text) return log.broken_off(text.error());
  SYMRIG_CHECK(log.finished());
  return is_standard_output(arguments.json) ? Result<void>() : print(*text);
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
  command.add_option("--algorithm", arguments->algorithm, listed(algorithm_names()))
      ->type_name("NAME")
      ->capture_default_str();
  command
      .add_option("--tolerance", arguments->tolerance,
                  "Tolerance, as a share of the flood-lit RMS; a smaller one needs more patterns")
      ->type_name("X");
  command
      .add_option("--dual-threshold", arguments->dual_threshold,
                  "For dual: do not refine responses below this share of the flood-lit RMS")
      ->type_name("X");
  command.add_option("--max-patterns", arguments->max_patterns, "Stop after this many photographs")
      ->type_name("N");
  command
      .add_option("--max-seconds", arguments->max_seconds, "Stop after this many seconds on the rig's clock")
      ->type_name("S");
  command
      .add_option("--target-error", arguments->target_error,
                  "Stop when the estimated error plus its uncertainty is below this share")
      ->type_name("E");
  command
      .add_option("--photograph-seconds", arguments->photograph_seconds,
                  "If exposures are planned: longest total exposure of one photograph (default: 10)")
      ->type_name("S");
  add_log_options(command, arguments->log);
  command
      .add_option(
          "--split", arguments->split,
          "Order of several views: flat, views-first, views-last, all-at-once, compensated (default: by "
          "the flood-lit photograph)")
      ->type_name("ORDER");
  command.add_flag("--check-axis", arguments->check_axis,
                   "First check with 8 photographs that camera and projector pixels coincide");
  command
      .add_option("--polish", arguments->polish,
                  "Steps of a final refit of all transport to all photographs; 0: none")
      ->type_name("N");
  command.footer(fmt::format(kCaptureExample, described_algorithms()) + "\n" + rig_help() + "\n" +
                 kExitCodes);
  for (const char* option :
       {"--tolerance", "--dual-threshold", "--max-seconds", "--target-error", "--photograph-seconds"})
    takes_number<double>(command.get_option(option));
  takes_number<std::int64_t>(command.get_option("--max-patterns"));
  takes_number<int>(command.get_option("--polish"));
  return [arguments] { return run(*arguments); };
}

}  // namespace symrig::apps
