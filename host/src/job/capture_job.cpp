// SPDX-License-Identifier: Apache-2.0

#include "symrig/job/capture_job.hpp"

#include "acquisition/tree/photographer.hpp"
#include "symrig/acquisition/probe.hpp"
#include "symrig/base/job_files.hpp"
#include "symrig/base/memory.hpp"
#include "symrig/calibration/camera_errors.hpp"
#include "symrig/calibration/camera_fit.hpp"
#include "symrig/calibration/coaxial_check.hpp"
#include "symrig/tensor/file.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <sys/resource.h>
#include <tbb/task_arena.h>

namespace symrig::job {

namespace {

/// A probe that shows its photographs to somebody else too. It changes nothing.
class WatchedProbe final : public ForwardingProbe {
 public:
  /// inner must outlive this.
  WatchedProbe(Probe& inner, SeePhotographs see) : ForwardingProbe(inner), see_(std::move(see)) {}

 private:
  Result<std::vector<Radiance>> seen(std::span<const Pattern> patterns,
                                     Result<std::vector<Radiance>> photographs) override {
    if (photographs && !patterns.empty() && photographs->size() == patterns.size())
      see_(cost(), patterns, *photographs);
    return photographs;
  }

  SeePhotographs see_;
};

/// A probe whose photographs of what nobody foresees end in time. It changes nothing of a rig that does not
/// plan its exposures.
class BriefProbe final : public ForwardingProbe {
 public:
  /// inner must outlive this. seconds: of each photograph, and of photographs of the dark projector.
  BriefProbe(Probe& inner, double seconds)
      : ForwardingProbe(inner),
        brief_{.parts = {}, .most_seconds = whole_most_seconds(seconds), .black_seconds = seconds} {}

  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override {
    return measure_expected(patterns, std::vector<Expectation>(patterns.size(), brief_));
  }

 private:
  Result<std::vector<Radiance>> seen(std::span<const Pattern> /*patterns*/,
                                     Result<std::vector<Radiance>> photographs) override {
    return photographs;
  }

  Expectation brief_;
};

}  // namespace

}  // namespace symrig::job

namespace symrig {

namespace {

std::int64_t peak_memory() {
  struct rusage usage {};
  getrusage(RUSAGE_SELF, &usage);
  return std::int64_t{usage.ru_maxrss} * 1024;
}

/// A job without an output has nothing to log for.
LogOptions log_options(const CaptureJob& job) {
  LogOptions options = job.log;
  options.off = options.off || job.output.empty();
  return options;
}

/// The algorithms that use the symmetry of T need a coaxial rig.
Result<void> check_symmetric(const OpenedRig& rig, Algorithm algorithm) {
  if (rig.coaxial || algorithm == Algorithm::brute || algorithm == Algorithm::dual) return {};
  Error error = rig.coaxial.error();
  error.hint += ", or capture with algorithm brute or dual";
  return error;
}

/// How much photographs of the same pattern differ beyond their noise, as a share of their light.
Result<double> flicker_of(Probe& rig) {
  const std::vector<Pattern> white(4, Pattern(rig.grid(), 1, 1.0F));
  SYMRIG_TRY(const std::vector<Radiance> seen, rig.measure(white));
  if (seen.empty()) return 0;
  std::vector<double> light;
  light.reserve(seen.size());
  double variance = 0;
  for (const Radiance& one : seen)
    light.push_back(std::accumulate(one.mean.values().begin(), one.mean.values().end(), 0.0));
  for (const float v : seen.front().variance.values()) variance += static_cast<double>(v);
  const auto [least, most] = std::ranges::minmax(light);
  constexpr double kSigmas = 6;
  return most > 0 ? std::max(0.0, most - least - kSigmas * std::sqrt(variance)) / most : 0;
}

/// Eight photographs are compared: a lamp that flickers looks like light that goes one way, and so does a
/// picture that is mirrored or late. What the algorithm has not judged by then is judged here. Of a budget of
/// seconds, each takes a fiftieth at most.
Result<void> check_axis(Probe& probe, const CaptureSettings& settings, const Progress& progress) {
  constexpr double kShare = 1.0 / 50;
  job::BriefProbe brief(probe, kShare * settings.max_seconds);
  Probe& rig = settings.max_seconds > 0 && probe.plans_exposures(1) ? static_cast<Probe&>(brief) : probe;
  if (!settings.economy.checks && !settings.unchecked) SYMRIG_CHECK(check_light_of_rig(rig, progress));
  Result<void> checked = require_coaxial(rig, {.progress = progress});
  if (checked || checked.error().code != ErrorCode::bad_value) return checked;
  constexpr double kFlickers = 0.01;
  SYMRIG_TRY(const double flicker, flicker_of(rig));
  if (flicker > kFlickers)
    return Error{
        ErrorCode::wrong_light,
        fmt::format("the axis cannot be checked: photographs of the same pattern differ by {:.2g} %; cause: "
                    "a lamp that flickers",
                    100 * flicker),
        "expose for whole periods of the lamp, or use a steady lamp"};
  Error error = checked.error();
  error.hint += ", or capture without check_axis";
  return error;
}

/// Runs the capture on a rig, through the log if there is one.
Result<CaptureOutcome> measure(const CaptureJob& job, const CaptureSettings& settings, OpenedRig& opened,
                               PhotographLog* log) {
  const Stopwatch watch;
  Probe& rig = *opened.probe;
  // A log of the camera's own photographs: the capture works on cells, and reads them as often as it likes.
  std::unique_ptr<PhotographLog> cells;
  std::optional<Development> development;
  if (log != nullptr && log->camera_grid() != log->grid()) {
    cells = make_memory_log(rig.grid(), rig.channels());
    RegisteredProbe& registered = *opened.registered;
    development.emplace(
        Development{registered.camera(),
                    [&registered](const Radiance& photograph) { return registered.to_cells(photograph); },
                    [&registered](std::int64_t photographs) { registered.forget(photographs); }, *cells});
  }
  const ProbeCost before = rig.cost_before();
  std::optional<LoggedProbe> logged;
  if (log != nullptr) logged.emplace(rig, *log, rig.together(), development);
  Probe& measuring = logged ? static_cast<Probe&>(*logged) : rig;
  std::optional<job::WatchedProbe> watched;
  if (job.see) watched.emplace(measuring, job.see);
  Probe& probe = watched ? static_cast<Probe&>(*watched) : measuring;
  CaptureOptions options = job.options;
  options.log = cells ? cells.get() : log;
  // Of a capture that goes on, the rig may have been repaired since.
  options.look_aside = [&](std::span<const Pattern> patterns,
                           std::span<const Expectation> expected) -> Result<std::vector<Radiance>> {
    if (logged && logged->replayed() > 0) return std::vector<Radiance>();
    return expected.empty() ? rig.measure(patterns) : rig.measure_expected(patterns, expected);
  };
  SYMRIG_TRY(CaptureResult result, capture(probe, options));
  if (opened.registered != nullptr) SYMRIG_CHECK(opened.registered->check_motion());
  CaptureSummary summary{.scene = rig.describe(),
                         .algorithm = settings.algorithm,
                         .rule = settings.rule,
                         .dual_threshold = settings.dual_threshold,
                         .target_error = settings.target_error,
                         .noise = opened.noise,
                         .cost = logged ? probe.cost() : probe.cost() - before,
                         .measure_seconds = watch.seconds() - result.process_seconds,
                         .total_seconds = job.watch.seconds(),
                         .peak_memory_bytes = peak_memory(),
                         .replayed = logged ? logged->replayed() : 0,
                         .trouble = opened.trouble(),
                         .made = job.made ? job.made() : Made{}};
  return CaptureOutcome{std::move(summary), std::move(result), {}};
}

Result<void> save(const std::string& path, CaptureOutcome& outcome, const Progress& progress) {
  StoredScene scene{outcome.result.tensor, outcome.json, std::move(outcome.result.held_out), outcome.camera};
  const Work work(progress);
  Result<void> saved = stoppable(work, [&]() -> Result<void> {
    work.begin("writing the scene", 0, outcome.result.patterns);
    return save_scene(path, scene, work);
  });
  outcome.result.held_out = std::move(scene.held_out);
  return saved;
}

std::string mebibytes(std::int64_t bytes) {
  return fmt::format("{}M", (bytes + (1 << 20) - 1) >> 20);
}

/// Whether the camera has pixels of its own that are wanted.
bool wants_own_pixels(const CaptureJob& job, const OpenedRig& rig) {
  const Registration* registration = rig.registered == nullptr ? nullptr : rig.registered->registration();
  return !job.output.empty() && !job.cells_only && registration != nullptr && !registration->shift;
}

/// Whether the capture goes on from a log of an earlier version, which keeps photographs on the cells.
bool goes_on_from_cells(const CaptureJob& job, const LogOptions& keeping) {
  if (!CaptureLog::goes_on(job.output, keeping)) return false;
  const auto of_camera = keeps_camera_photographs(CaptureLog::path_of(job.output));
  return of_camera && !*of_camera;
}

/// Why T on the camera's own pixels cannot be fitted, and what to do, as far as the rig and the job tell; "":
/// they tell nothing against it.
std::string no_camera_fit(const CaptureJob& job, const OpenedRig& rig) {
  const RegisteredProbe& registered = *rig.registered;
  if (job.log.off) return "without a log, nothing keeps the camera's photographs; capture with one";
  if (registered.steps() == nullptr)
    return "the rig may be registered again on the way, and photographs of two maps do not mix; fasten the "
           "rig and leave out moved = \"register\"";
  if (goes_on_from_cells(job, job.log))
    return "the log of an earlier version keeps photographs on the cells; capture anew";
  if (job.options.algorithm != Algorithm::symrig && job.options.algorithm != Algorithm::paper)
    return "this algorithm measures T without symmetry; capture with symrig";
  if (rig.rig != nullptr && rig.rig->mosaic() != Mosaic::none && !registered.mosaic())
    return "each pixel sees one colour, and the capture is in grey; set capture.colour in the rig file";
  if (registered.registration()->ghost.found)
    return "the camera sees a ghost of the scene; remove it from the optics";
  return "";
}

/// The same of a finished search.
std::string no_camera_fit(const CaptureJob& job, const OpenedRig& rig, const CaptureResult& result,
                          const PhotographLog* log) {
  if (std::string why = no_camera_fit(job, rig); !why.empty()) return why;
  if (!result.tensor.symmetric()) return "brute force measured T, without symmetry";
  const std::int64_t bytes =
      camera_fit_bytes(result.tensor, rig.registered->registration()->camera(), log->size());
  if (job.memory > 0 && bytes > job.memory)
    return fmt::format("the fit needs {} of memory, and {} are allowed; allow more memory", mebibytes(bytes),
                       mebibytes(job.memory));
  return "";
}

/// The job with exposures for what is fitted afterwards.
CaptureJob exposed_for_pixels(CaptureJob job, const OpenedRig& rig) {
  if (wants_own_pixels(job, rig) && no_camera_fit(job, rig).empty())
    job.options.exposure = goal_of_pixels(job.options.exposure, rig.registered->weights().noise_share());
  return job;
}

/// Without those that were held out, and judged by them.
Result<void> fit_to(const CaptureJob& job, const OpenedRig& rig, const PhotographLog& log,
                    CaptureOutcome& outcome) {
  const Stopwatch watch;
  const Registration& registration = *rig.registered->registration();
  const CaptureResult& result = outcome.result;
  SYMRIG_TRY(CameraTransport fit, fit_camera(result.tensor, registration, log,
                                             {.mosaic = rig.registered->mosaic(),
                                              .held_out = result.held_out_at,
                                              .registration = fmt::format("{:08x}", rig.registered->digest()),
                                              .progress = job.options.progress}));
  CameraFacts facts{fit.camera_grid(), fit.rows(), fit.coefficients(), fit.bytes(), watch.seconds()};
  if (!result.held_out_at.empty()) {
    SYMRIG_TRY(CameraErrors errors,
               estimate_camera_errors(fit, SeenCells(fit, registration.corners()), log, result.held_out_at,
                                      result.noise_check, job.options.progress));
    fit.set_chi_square(errors.chi_square);
    facts.bytes = fit.bytes();
    facts.errors = std::move(errors.estimate);
    facts.unjudged = errors.unjudged;
  }
  outcome.camera = std::make_shared<const CameraTransport>(std::move(fit));
  outcome.summary.camera = std::move(facts);
  return {};
}

/// Adds T on the camera's own pixels, if the camera has some. The scene on the cells stays if that fails, so
/// that is no reason to fail. late: becomes true if the job's time for it was too little.
Result<void> fit_own_pixels(const CaptureJob& job, const OpenedRig& rig, const PhotographLog* log,
                            CaptureOutcome& outcome, bool& late) {
  CaptureJob limited = job;
  limited.options.progress = [&, watch = Stopwatch()](const ProgressEvent& event) {
    late = late || (job.fit_seconds && watch.seconds() > *job.fit_seconds);
    return !late && (!job.options.progress || job.options.progress(event));
  };
  Result<void> fitted = guarded([&] { return fit_to(limited, rig, *log, outcome); });
  if (fitted) return {};
  if (late && fitted.error().code == ErrorCode::interrupted) {
    outcome.summary.camera_missing = fmt::format(
        "the fit needs more than {} s; the log is kept: resume with more seconds", *job.fit_seconds);
    return {};
  }
  if (fitted.error().code != ErrorCode::interrupted) {
    outcome.summary.camera_missing = fitted.error().what;
    return {};
  }
  Error error = std::move(fitted).error();
  error.what = fmt::format("{} is written, without the camera's own pixels: {}", job.output, error.what);
  return error;
}

Result<CaptureOutcome> measure_and_save(const CaptureJob& job, const CaptureSettings& settings,
                                        OpenedRig& rig, PhotographLog* log, bool& fit_was_late) {
  SYMRIG_TRY(CaptureOutcome outcome, measure(job, settings, rig, log));
  if (job.accept) SYMRIG_CHECK(job.accept(outcome.result));
  if (wants_own_pixels(job, rig))
    outcome.summary.camera_missing = no_camera_fit(job, rig, outcome.result, log);
  const auto write = [&]() -> Result<void> {
    outcome.json = capture_json(outcome.summary, outcome.result);
    return job.output.empty() ? Result<void>() : save(job.output, outcome, job.options.progress);
  };
  const bool fits = wants_own_pixels(job, rig) && outcome.summary.camera_missing.empty();
  if (fits) outcome.summary.camera_missing = "their fit was broken off; resume the capture";
  SYMRIG_CHECK(write());
  if (fits) {
    outcome.summary.camera_missing.clear();
    SYMRIG_CHECK(fit_own_pixels(job, rig, log, outcome, fit_was_late));
    outcome.summary.total_seconds = job.watch.seconds();
    outcome.summary.peak_memory_bytes = peak_memory();
    SYMRIG_CHECK(write());
  }
  if (!job.json.empty()) SYMRIG_CHECK(write_text_output(job.json, outcome.json));
  return outcome;
}

/// A log of a registered camera keeps the camera's own photographs, unless an older one goes on.
LogIdentity identity_of(const CaptureJob& job, const OpenedRig& rig, const CaptureSettings& settings,
                        const LogOptions& keeping) {
  LogIdentity identity = log_identity(*rig.probe, settings);
  if (rig.registered == nullptr || keeping.off) return identity;
  if (goes_on_from_cells(job, keeping)) return identity;
  identity.steps = rig.registered->steps();
  if (identity.steps) identity.channels = rig.registered->camera().channels();
  return identity;
}

/// Where scratch files go: to the disk of the output.
std::filesystem::path scratch_folder(const CaptureJob& job) {
  if (job.output.empty()) return std::filesystem::temp_directory_path();
  const std::filesystem::path folder = std::filesystem::path(job.output).parent_path();
  return folder.empty() ? "." : folder;
}

constexpr std::int64_t kProgramBytes = std::int64_t{32} << 20;  // code, libraries, a simulated scene

Result<void> check_memory(std::int64_t memory, std::int64_t least, const Probe& rig) {
  if (memory >= least) return {};
  return Error{
      ErrorCode::limit,
      fmt::format("memory of {} is too little for photographs of {} with {} channel{}", mebibytes(memory),
                  to_string(rig.grid()), rig.channels(), rig.channels() == 1 ? "" : "s"),
      fmt::format("allow {} or more", mebibytes(least))};
}

Error no_measurement(const char* option, const char* next) {
  return {ErrorCode::bad_argument, fmt::format("{} 0 allows no measurement", option), next};
}

}  // namespace

StoredScene CaptureOutcome::scene() && {
  return {std::move(result.tensor), std::move(json), std::move(result.held_out), std::move(camera)};
}

Result<void> check_budgets(const GivenBudgets& given) {
  if (given.max_patterns == 0) return no_measurement("max_patterns", "give 1 or more");
  if (given.max_seconds == 0.0) return no_measurement("max_seconds", "give seconds, such as 3600");
  if (given.target_error == 0.0) return no_measurement("target_error", "give a number above 0, such as 0.02");
  return {};
}

Result<CaptureSettings> check_job(const CaptureJob& job) {
  if (job.fit_seconds && !(*job.fit_seconds > 0))
    return Error{ErrorCode::bad_argument, fmt::format("fit_seconds {} allows no fit", *job.fit_seconds),
                 "give seconds above 0, or ask for cells"};
  SYMRIG_TRY(CaptureSettings settings, settings_of(job.options));
  SYMRIG_CHECK(CaptureLog::check(job.output, log_options(job)));
  return settings;
}

Result<void> check_job(const CaptureJob& job, const OpenedRig& rig) {
  SYMRIG_CHECK(check_rig(job.options, *rig.probe));
  if (job.fit_seconds && !wants_own_pixels(job, rig))
    return Error{ErrorCode::bad_argument, "fit_seconds has no effect where no camera pixels are fitted",
                 "leave it out"};
  return check_symmetric(rig, job.options.algorithm);
}

std::string scene_to_replace(const CaptureJob& job, const OpenedRig& rig) {
  std::error_code ignored;
  if (job.output.empty() || !std::filesystem::exists(job.output, ignored)) return "";
  const auto held = load_scene(job.output, {.memory = 1, .camera = false});  // leaves stay in the file
  if (!held) return "";
  std::string scene = captured_scene(*held);
  return scene == rig.probe->describe() ? "" : scene;
}

std::int64_t log_bytes_each(const CaptureJob& job, const OpenedRig& rig) {
  const LogOptions keeping = log_options(job);
  const auto settings = settings_of(job.options);
  return keeping.off || !settings ? 0 : bytes_of_photograph(identity_of(job, rig, *settings, keeping));
}

std::int64_t least_memory(Grid grid, int channels) {
  // Each thread that applies transport has sixteen photographs as floats.
  const std::int64_t applied = grid.size() * 16 * 4 * tbb::this_task_arena::max_concurrency();
  return kProgramBytes + applied + acquisition::bytes_in_flight(grid, channels);
}

std::int64_t memory_wanted(const CaptureSettings& settings, Grid grid, int channels) {
  constexpr std::int64_t kPixel = 1300, kSample = 400;  // bytes
  // Polish keeps its photographs, some 330, if pattern and weights fit into this.
  constexpr std::int64_t kMostKept = std::int64_t{300} << 20, kKept = std::int64_t{330} * 4;
  const std::int64_t kept = grid.size() * (1 + channels) * kKept;
  const bool keeps = settings.economy.polish > 0 && kept <= kMostKept;
  return kProgramBytes + grid.size() * (kPixel + channels * kSample) + (keeps ? kept : 0);
}

namespace {

Result<CaptureOutcome> run_exposed(const CaptureJob& job, OpenedRig& rig) {
  SYMRIG_TRY(const CaptureSettings settings, check_job(job));
  SYMRIG_CHECK(check_job(job, rig));
  const LogOptions keeping = log_options(job);
  CaptureJob checked = job;
  const bool checks_axis = job.check_axis && !CaptureLog::goes_on(job.output, keeping);
  bool misaligned = false, searches = false, wrong = false;
  checked.options.before_search = [&]() -> Result<void> {
    Result<void> found =
        checks_axis ? check_axis(*rig.probe, settings, job.options.progress) : Result<void>();
    misaligned = !found;
    searches = !misaligned;
    return found;
  };
  checked.accept = [&](const CaptureResult& result) -> Result<void> {
    // The picture of a rig that is not coaxial may lie anywhere.
    const Result<void> light = rig.coaxial ? judge_light(*rig.probe, job.options, result) : Result<void>();
    wrong = !light && light.error().code == ErrorCode::wrong_light;
    return light && job.accept ? job.accept(result) : light;
  };
  const std::int64_t least = least_memory(rig.probe->grid(), rig.probe->channels());
  if (job.memory > 0) SYMRIG_CHECK(check_memory(job.memory, least, *rig.probe));
  // Nobody asked for the usual memory, so it is no reason to refuse.
  const std::int64_t memory = job.memory > 0 ? job.memory : std::max(usual_memory(), least);
  const MemoryScope scope({memory, least, scratch_folder(job)});
  const LogIdentity identity = identity_of(job, rig, settings, keeping);
  SYMRIG_TRY(CaptureLog log, CaptureLog::open(job.output, keeping, identity));
  bool fit_was_late = false;
  Result<CaptureOutcome> outcome =
      guarded([&] { return measure_and_save(checked, settings, rig, log.log(), fit_was_late); });
  // The first photographs of a rig that must be changed are of no use later, nor are those that nothing but a
  // look at the rig can judge: it may be mended before the capture goes on. Those of a whole search stay:
  // only a person can tell what they are worth (--unchecked).
  if (!outcome && (misaligned || wrong || (!searches && outcome.error().code == ErrorCode::wrong_light)))
    return log.useless(outcome.error());
  if (!outcome) return log.broken_off(outcome.error());
  if (!fit_was_late) SYMRIG_CHECK(log.finished());
  return outcome;
}

}  // namespace

Result<CaptureOutcome> run_job(const CaptureJob& job, OpenedRig& rig) {
  return run_exposed(exposed_for_pixels(job, rig), rig);
}

}  // namespace symrig
