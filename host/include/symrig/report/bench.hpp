// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/report/relight_speed.hpp"
#include "symrig/rig/rig.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace symrig {

/// The tolerances that one algorithm is run with.
struct BenchSweep {
  Algorithm algorithm = Algorithm::symrig;
  std::vector<double> tolerances = {};  ///< shares of the flood-lit RMS; empty: the algorithm has none
  double preset = 0;                    ///< the default tolerance; 0 if the algorithm has none
};

/// The captures of `symrig bench`: every profile × scene × size × seed × algorithm × tolerance.
struct BenchPlan {
  std::vector<std::string> scenes = {};
  std::vector<Grid> sizes = {};
  std::vector<int> seeds = {};
  std::vector<std::string> profiles = {"standard"};  ///< of the simulated rig: rig_profiles()
  std::vector<BenchSweep> sweeps = {};
  bool camera_noise = true;
  int channels = 1;
  std::int64_t brute_pixels = 4096;  ///< brute force runs on grids up to this many pixels
};

/// One capture to run.
struct BenchCase {
  std::string scene;
  Grid grid;
  int seed = 1;
  Algorithm algorithm = Algorithm::symrig;
  std::optional<double> tolerance = {};  ///< empty: the algorithm has none
  bool preset = false;                   ///< uses the default tolerance
  std::string profile = "standard";      ///< of the rig

  bool operator==(const BenchCase&) const = default;
};

/// All cases in the order of the run: by profile, size, scene and seed; large tolerances before small ones.
/// The default tolerance of `paper` is always included, because the summary uses it. Deterministic; no case
/// twice.
std::vector<BenchCase> bench_cases(const BenchPlan& plan);

/// The rig of a case: "sim:gummy?size=64x64&seed=2".
std::string bench_rig(const BenchPlan& plan, const BenchCase& what);

/// One finished or failed capture. Times are in seconds.
struct BenchCapture {
  BenchCase what;
  std::int64_t patterns = 0, frames = 0, tensor_bytes = 0;
  double rig_seconds = 0;       ///< on the rig's clock
  RigTime rig_time = {};        ///< the parts of it
  double process_seconds = 0;   ///< host: subtract, test, schedule
  double merge_seconds = 0;     ///< host: exposures into photographs
  double simulate_seconds = 0;  ///< host: simulating the scene, which a real rig does not need
  double wall_seconds = 0;      ///< total waiting time of the user, without the evaluation
  TransportErrors error;
  std::string failure;  ///< the error of a failed capture; else empty

  bool done() const { return failure.empty(); }
  double host_seconds() const { return process_seconds + merge_seconds; }
  /// Time of the same capture with a real rig that waits for the host: rig's clock plus host.
  double capture_seconds() const { return rig_seconds + host_seconds(); }
};

struct BenchRun {
  BenchPlan plan;
  std::vector<BenchCapture> captures;
  std::size_t planned = 0;  ///< captures of a complete run
  std::optional<RelightSpeed> relight = {};
  std::string relight_of = {};  ///< rig and algorithm of the tensor that was relit

  bool complete() const { return captures.size() == planned; }
};

/// The JSON of `symrig bench --json` (docs/command-line.md): one object, indented, ends with a newline.
std::string bench_json(const BenchRun& run);

/// A line of names, then one line for each capture: RFC 4180 with line feeds. A number that does not exist is
/// empty.
std::string bench_csv(const BenchRun& run);

/// The table as text, line by line, so that it can be shown while the bench runs.
std::string bench_table_head();
std::string bench_table_row(const BenchCapture& capture);
/// The summary of the table: symrig against paper at equal error and at equal patterns, flood bias,
/// relighting.
std::string bench_summary_text(const BenchRun& run);

/// One self-contained HTML page: the summary, error over patterns and over seconds for each scene (log-log),
/// and the table.
std::string bench_page(const BenchRun& run);

}  // namespace symrig
