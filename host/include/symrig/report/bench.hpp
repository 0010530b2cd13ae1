// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/report/relight_speed.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace symrig {

/// The tolerances that one algorithm is run with.
struct BenchSweep {
  Algorithm algorithm = Algorithm::symrig;
  std::vector<double> tolerances = {};  ///< shares of the flood-lit RMS; empty: the algorithm has none
  double preset = 0;                    ///< the one it runs with unless told otherwise; 0 if it has none
};

/// What `symrig bench` is to run: every scene × size × seed × algorithm × tolerance.
struct BenchPlan {
  std::vector<std::string> scenes = {};
  std::vector<Grid> sizes = {};
  std::vector<int> seeds = {};
  std::vector<BenchSweep> sweeps = {};
  bool camera_noise = true;
  int channels = 1;
  std::int64_t brute_pixels = 4096;  ///< brute force is run on grids up to this many pixels
};

/// One capture to be run.
struct BenchCase {
  std::string scene;
  Grid grid;
  int seed = 1;
  Algorithm algorithm = Algorithm::symrig;
  std::optional<double> tolerance = {};  ///< empty: the algorithm has none
  bool preset = false;                   ///< runs as it would without any option

  bool operator==(const BenchCase&) const = default;
};

/// All cases, in the order in which they are run: size by size, scene by scene, seed by seed; loose
/// tolerances before tight ones. The preset of `paper` is always among its tolerances, because the summary is
/// read there. Deterministic; no case twice.
std::vector<BenchCase> bench_cases(const BenchPlan& plan);

/// The rig of a case: "sim:gummy?size=64x64&seed=2".
std::string bench_rig(const BenchPlan& plan, const BenchCase& what);

/// One capture that was run. Seconds.
struct BenchCapture {
  BenchCase what;
  std::int64_t patterns = 0, frames = 0, tensor_bytes = 0;
  double rig_seconds = 0;       ///< on the rig's clock
  double process_seconds = 0;   ///< host: subtract, test, schedule
  double merge_seconds = 0;     ///< host: exposures into photographs
  double simulate_seconds = 0;  ///< host: pretending to be the scene, which a real rig does not need
  double wall_seconds = 0;      ///< all together as the user waits for it, without the evaluation
  TransportErrors error;
  std::string failure;  ///< why there is no result; empty if there is one

  bool done() const { return failure.empty(); }
  double host_seconds() const { return process_seconds + merge_seconds; }
  /// What the same capture takes with a real rig that waits for the host: rig's clock plus host.
  double capture_seconds() const { return rig_seconds + host_seconds(); }
};

struct BenchRun {
  BenchPlan plan;
  std::vector<BenchCapture> captures;
  std::size_t planned = 0;  ///< captures that a complete run holds
  std::optional<RelightSpeed> relight = {};
  std::string relight_of = {};  ///< rig and algorithm of the tensor that was relit

  bool complete() const { return captures.size() == planned; }
};

/// The keys of `symrig bench --json` (docs/command-line.md): one JSON object, indented, ends with a newline.
std::string bench_json(const BenchRun& run);

/// One line a capture under a line of names, RFC 4180 with line feeds; a number that does not exist is empty.
std::string bench_csv(const BenchRun& run);

/// The readable table, line by line, so that it can be shown while the bench runs.
std::string bench_table_head();
std::string bench_table_row(const BenchCapture& capture);
/// What the table comes to: symrig against paper at equal error and at equal patterns, flood bias,
/// relighting.
std::string bench_summary_text(const BenchRun& run);

/// One self-contained HTML page: the summary, error against patterns and against seconds for each scene
/// (log-log), and the table.
std::string bench_page(const BenchRun& run);

}  // namespace symrig
