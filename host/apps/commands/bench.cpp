// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/bench.hpp"

#include "bench_plan.hpp"
#include "command.hpp"
#include "meter.hpp"
#include "output.hpp"
#include "rig.hpp"
#include "symrig/base/memory.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

struct BenchArguments {
  BenchChoice choice;
  std::string html, json, csv;
  bool no_memory = false;

  std::array<const std::string*, 3> outputs() const { return {&html, &json, &csv}; }
  /// Results on standard output are for a script, so nothing else is printed there.
  bool prints() const { return printed() == 0; }
  std::ptrdiff_t printed() const {
    const auto all = outputs();
    return std::count_if(all.begin(), all.end(),
                         [](const std::string* path) { return is_standard_output(*path); });
  }
};

constexpr const char* kBenchExample =
    "Example:\n"
    "  symrig bench --scenes gummy,mirror --size 64x64 --seeds 3 -o bench.html --json bench.json\n"
    "  symrig bench --quick                                           all scenes, in about a "
    "minute\n"
    "\n"
    "Runs every scene with every algorithm over a range of tolerances. Reports for each error: "
    "patterns, frames,\n"
    "time on the rig's clock, processing time, wall-clock time, bytes. Brute force runs only up to "
    "4,096 pixels.\n"
    "Then compares symrig with paper at equal error and at equal patterns, and relighting with "
    "memory speed.\n"
    "Ctrl-C writes the results so far, marked as incomplete.\n";

/// The results so far.
struct Bench {
  BenchRun run;
  TransportTensor largest;            ///< of symrig or paper; used to measure relighting
  std::optional<Error> stopped = {};  ///< the reason of an early end
  std::optional<Error> failed = {};   ///< the first capture that failed
  std::size_t failures = 0;
};

void keep_largest(const BenchCase& what, TransportTensor tensor, Bench& bench) {
  if (!algorithm_info(what.algorithm).hierarchical || tensor.bytes() <= bench.largest.bytes()) return;
  bench.largest = std::move(tensor);
  bench.run.relight_of = bench_rig(bench.run.plan, what) + ", " + std::string(name(what.algorithm));
}

/// Runs one capture. A failure becomes a row too; only an interrupt ends the bench.
void add_case(const BenchCase& what, Bench& bench) {
  const std::string label =
      fmt::format("bench {}/{} {} {} {}", bench.run.captures.size() + 1, bench.run.planned, what.scene,
                  to_string(what.grid), name(what.algorithm));
  Meter meter(label, "photographs");
  Result<BenchedTensor> result = guarded([&] { return run_case(bench.run.plan, what, meter.progress()); });
  if (result) {
    bench.run.captures.push_back(result->capture);
    keep_largest(what, std::move(result->tensor), bench);
    return;
  }
  if (result.error().code == ErrorCode::interrupted) {
    bench.stopped = result.error();
    return;
  }
  BenchCapture failed{.what = what, .error = {}, .failure = result.error().line()};
  bench.run.captures.push_back(std::move(failed));
  if (bench.failures++ == 0) bench.failed = result.error();
}

Result<void> capture_all(const std::vector<BenchCase>& cases, bool prints, Bench& bench) {
  if (prints) SYMRIG_CHECK(print(bench_table_head()));
  for (const BenchCase& what : cases) {
    add_case(what, bench);
    if (bench.stopped) return {};
    if (prints) SYMRIG_CHECK(print(bench_table_row(bench.run.captures.back())));
  }
  return {};
}

/// Measures relighting against memory speed. If memory is too small, the bench goes on and the reason goes to
/// standard error.
void add_memory_speed(Bench& bench) {
  if (bench.stopped || bench.largest.bytes() == 0) return;
  std::optional<Meter> meter(std::in_place, "bench", "rounds");
  const Result<RelightSpeed> speed =
      measure_relight(bench.largest, {.array_bytes = 0, .rounds = 15, .progress = meter->progress()});
  meter.reset();
  if (speed)
    bench.run.relight = *speed;
  else if (speed.error().code == ErrorCode::interrupted)
    bench.stopped = speed.error();
  else
    print_error("bench", speed.error().what + "; --no-memory skips this measurement");
}

Result<void> write_results(const BenchArguments& arguments, const BenchRun& run) {
  if (!arguments.json.empty()) SYMRIG_CHECK(write_text(arguments.json, bench_json(run)));
  if (!arguments.csv.empty()) SYMRIG_CHECK(write_text(arguments.csv, bench_csv(run)));
  if (!arguments.html.empty()) SYMRIG_CHECK(write_text(arguments.html, bench_page(run)));
  return arguments.prints() ? print(bench_summary_text(run)) : Result<void>();
}

/// The final result, after all files are written.
Result<void> ending(const Bench& bench) {
  if (bench.stopped)
    return Error{ErrorCode::interrupted,
                 fmt::format("stopped after {} of {} captures", bench.run.captures.size(), bench.run.planned),
                 bench.run.complete() ? "their results are written; memory speed was not measured"
                                      : "the results so far are written, marked as incomplete"};
  if (bench.failed)
    return Error{bench.failed->code,
                 fmt::format("{} of {} captures failed, the first: {}", bench.failures, bench.run.planned,
                             bench.failed->what),
                 "the results of the others are written"};
  return {};
}

Result<void> run(const BenchArguments& arguments) {
  if (arguments.printed() > 1)
    return Error{ErrorCode::bad_argument, "more than one of --html, --json and --csv is -",
                 "give the others a file: standard output takes only one"};
  SYMRIG_TRY(BenchPlan plan, bench_plan(arguments.choice));
  SYMRIG_CHECK(JobFiles()
                   .writes("--html", arguments.html, FileFormat::page)
                   .writes("--json", arguments.json, FileFormat::json)
                   .writes("--csv", arguments.csv, FileFormat::table)
                   .check());
  const std::vector<BenchCase> cases = bench_cases(plan);
  Bench bench;
  bench.run.plan = std::move(plan);
  bench.run.planned = cases.size();
  SYMRIG_CHECK(capture_all(cases, arguments.prints(), bench));
  if (!arguments.no_memory) add_memory_speed(bench);
  SYMRIG_CHECK(write_results(arguments, bench.run));
  return ending(bench);
}

}  // namespace

Job add_bench(CLI::App& command) {
  const auto arguments = std::make_shared<BenchArguments>();
  add_bench_choice(command, arguments->choice);
  command
      .add_option("-o,--html", arguments->html, "HTML page with the curves to write; - is standard output")
      ->type_name("FILE");
  add_json(command, arguments->json);
  command.add_option("--csv", arguments->csv, "Also write the table as CSV; - is standard output")
      ->type_name("FILE");
  command.add_flag("--no-memory", arguments->no_memory,
                   "Do not measure memory speed (it needs about 400 MB, more on machines with large caches)");
  add_progress(command);
  command.footer(std::string(kBenchExample) + "\nScenes: " + known_scenes() + "\n\n" + kExitCodes);
  return [arguments] { return run(*arguments); };
}

}  // namespace symrig::apps
