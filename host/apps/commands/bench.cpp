// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/bench.hpp"

#include "bench_case.hpp"
#include "bench_plan.hpp"
#include "command.hpp"
#include "console.hpp"
#include "files.hpp"
#include "guarded.hpp"
#include "meter.hpp"
#include "rig.hpp"

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
  /// Results on standard output are for a script: nothing else is printed there.
  bool talks() const { return printed() == 0; }
  std::ptrdiff_t printed() const {
    const auto all = outputs();
    return std::count_if(all.begin(), all.end(),
                         [](const std::string* path) { return is_standard_output(*path); });
  }
};

constexpr const char* kBenchExample =
    "Example:\n"
    "  symrig bench --scenes gummy,mirror --size 64x64 --seeds 3 -o bench.html --json bench.json\n"
    "  symrig bench --quick                                           all scenes, in about a minute\n"
    "\n"
    "Runs every scene with every algorithm over a sweep of tolerances and says what an error costs: "
    "patterns, "
    "frames, time\n"
    "on the rig's clock, on this computer, on the wall, bytes. Brute force only up to 4,096 pixels. Then "
    "symrig against paper\n"
    "at equal error and at equal patterns, and relighting against memory speed. Ctrl-C writes what is done "
    "so "
    "far, marked\n"
    "as incomplete.\n";

/// What the bench has found so far.
struct Bench {
  BenchRun run;
  TransportTensor largest;            ///< of symrig or paper, to be relit
  std::optional<Error> stopped = {};  ///< why it ended before its time
  std::optional<Error> failed = {};   ///< the first capture that failed
  std::size_t failures = 0;
};

void keep_largest(const BenchCase& what, TransportTensor tensor, Bench& bench) {
  if (!algorithm_info(what.algorithm).hierarchical || tensor.bytes() <= bench.largest.bytes()) return;
  bench.largest = std::move(tensor);
  bench.run.relight_of = bench_rig(bench.run.plan, what) + ", " + std::string(name(what.algorithm));
}

/// One capture. A failure is a row like any other; only an interrupt ends the bench.
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

Result<void> capture_all(const std::vector<BenchCase>& cases, bool talks, Bench& bench) {
  if (talks) SYMRIG_CHECK(print(bench_table_head()));
  for (const BenchCase& what : cases) {
    add_case(what, bench);
    if (bench.stopped) return {};
    if (talks) SYMRIG_CHECK(print(bench_table_row(bench.run.captures.back())));
  }
  return {};
}

/// A machine without the memory for it still has a bench: the reason goes to standard error.
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
    print_error("bench", speed.error().what + "; --no-memory leaves it out");
}

Result<void> write_results(const BenchArguments& arguments, const BenchRun& run) {
  if (!arguments.json.empty()) SYMRIG_CHECK(write_text(arguments.json, bench_json(run)));
  if (!arguments.csv.empty()) SYMRIG_CHECK(write_text(arguments.csv, bench_csv(run)));
  if (!arguments.html.empty()) SYMRIG_CHECK(write_text(arguments.html, bench_page(run)));
  return arguments.talks() ? print(bench_summary_text(run)) : Result<void>();
}

/// How it ended, after everything that can be written is written.
Result<void> ending(const Bench& bench) {
  if (bench.stopped)
    return Error{ErrorCode::interrupted,
                 fmt::format("stopped after {} of {} captures", bench.run.captures.size(), bench.run.planned),
                 bench.run.complete() ? "their results are written, memory speed is not among them"
                                      : "what was done is written, marked as incomplete"};
  if (bench.failed)
    return Error{bench.failed->code,
                 fmt::format("{} of {} captures failed, the first: {}", bench.failures, bench.run.planned,
                             bench.failed->what),
                 "the others are written"};
  return {};
}

Result<void> run(const BenchArguments& arguments) {
  if (arguments.printed() > 1)
    return Error{ErrorCode::bad_argument, "more than one of --html, --json and --csv is -",
                 "standard output takes one of them; give the others a file"};
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
  SYMRIG_CHECK(capture_all(cases, arguments.talks(), bench));
  if (!arguments.no_memory) add_memory_speed(bench);
  SYMRIG_CHECK(write_results(arguments, bench.run));
  return ending(bench);
}

}  // namespace

Job add_bench(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("bench", "Speed against error: every scene, algorithm and tolerance in one run");
  const auto arguments = std::make_shared<BenchArguments>();
  add_bench_choice(*command, arguments->choice);
  command->add_option("-o,--html", arguments->html, "Page with the curves to write; - is standard output")
      ->type_name("FILE");
  add_json(*command, arguments->json);
  command->add_option("--csv", arguments->csv, "Write the table as CSV too; - is standard output")
      ->type_name("FILE");
  command->add_flag("--no-memory", arguments->no_memory,
                    "Leave out memory speed (it takes about 400 MB, more on machines with large caches)");
  command->footer(std::string(kBenchExample) + "\nScenes: " + known_scenes() + "\n\n" + kExitCodes);
  return [arguments] { return run(*arguments); };
}

}  // namespace symrig::apps
