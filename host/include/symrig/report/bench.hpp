// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/rig/rig.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace symrig {

/// Memory speed and relighting time with the same number of threads, measured in the same minute.
struct ThreadSpeed {
  int threads = 1;
  double triad_bytes_per_second = 0;  ///< best round; 12 bytes for each element, as in STREAM
  double relight_seconds = 0;         ///< one photograph, median round, tensor in no cache
};

struct RelightSpeed {
  std::int64_t array_bytes = 0;   ///< of each of the triad's three arrays
  std::int64_t tensor_bytes = 0;  ///< read once for a photograph
  ThreadSpeed one, all;           ///< one thread; every thread of the machine

  /// The tensor's bytes per second as a share of the triad's. 1 means that relighting runs at memory speed.
  double share_of_triad(const ThreadSpeed& speed) const;
};

struct RelightSpeedOptions {
  std::int64_t array_bytes = 0;  ///< 0: more than four times the last-level cache, at least 128 MiB
  int rounds = 15;
  Progress progress = {};  ///< may be empty; one event for each round
};

/// Compares the time of T · pattern with a triad a = b + s c over arrays that fit into no cache. The two
/// alternate in one run. So each application finds the tensor in no cache, and both see the same state of the
/// machine. The threads of the library are limited meanwhile.
/// fails: bad_argument (no rounds), limit (no memory for the arrays), interrupted.
/// source: McCalpin, STREAM.
Result<RelightSpeed> measure_relight(const TransportTensor& tensor, const RelightSpeedOptions& options = {});

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

/// One capture as a point: its cost (patterns or seconds) and its relative error.
struct CostError {
  double cost = 0;
  double error = 0;
};

/// How a reading was obtained. Nothing is extrapolated.
enum class Reach : std::uint8_t {
  read,         ///< interpolated between two captures, or taken from one
  at_most,      ///< the end of the sweep is already better: the true value is this or less
  not_reached,  ///< no capture of the sweep reaches it
};

struct CurveReading {
  Reach reach = Reach::not_reached;
  double value = 0;  ///< 0 where not reached

  bool reached() const { return reach != Reach::not_reached; }
};

/// The captures that no other capture beats in both cost and error: increasing cost, strictly decreasing
/// error. A sweep is seldom monotonic, because a tighter tolerance may need more patterns and still give a
/// larger error. A user would choose one of these captures. Points without a finite cost > 0 and a finite
/// error ≥ 0 are ignored.
std::vector<CostError> lower_envelope(std::vector<CostError> captures);

/// The cost at which an envelope reaches `error`, by linear interpolation of log cost over log error. at_most
/// if the cheapest capture already has a smaller error. A capture with error 0 has no logarithm: between it
/// and its neighbour the result is its own cost, as at_most.
CurveReading cost_at_error(std::span<const CostError> envelope, double error);

/// The error of an envelope at `cost`, by the same interpolation: not_reached below the cheapest capture,
/// at_most beyond the most expensive one.
CurveReading error_at_cost(std::span<const CostError> envelope, double cost);

/// value / reference. Two exact results (0 / 0) are equally good: 1. Not reached if only the reference is 0.
CurveReading ratio(const CurveReading& value, double reference);

/// The larger of two readings: the cost that satisfies both.
CurveReading larger(const CurveReading& a, const CurveReading& b);

/// Geometric mean of ratios. Ratios that were not reached, and zeros, are counted instead of averaged, so
/// that the mean does not hide them.
struct MeanRatio {
  double value = 0;  ///< 0 if there is nothing to average
  int averaged = 0;
  int bounds = 0;       ///< averaged ratios that are at_most: the true mean is `value` or less
  int not_reached = 0;  ///< not averaged; they would increase the mean
  int zero = 0;         ///< not averaged; they would make the mean 0

  Reach reach() const;  ///< not_reached if a ratio that would increase the mean is missing
};
MeanRatio geometric_mean(std::span<const CurveReading> ratios);

/// `symrig` against `paper` on one scene and seed. The reference is `paper` at its default tolerance. It is
/// compared with the lower envelope of symrig's captures of the same scene, size and seed.
struct BenchPair {
  std::string scene;
  int seed = 1;
  double paper_patterns = 0;
  TransportErrors paper_error;
  // symrig's patterns / paper's, at paper's error:
  CurveReading patterns_at_indirect, patterns_at_bar_indirect, patterns_at_both;
  // symrig's error / paper's, at paper's patterns:
  CurveReading indirect_at_patterns, frobenius_at_patterns;
};

/// flood / frobenius over the captures of one algorithm on one scene: a bias under all-positive light, which
/// random patterns average away.
struct FloodBias {
  std::string scene;
  Algorithm algorithm = Algorithm::symrig;
  double at_preset = 0;  ///< worst over seeds at the default tolerance; 0 if there is none
  double worst = 0;      ///< worst over all tolerances
};

/// The summary of one grid size on one rig.
struct BenchSummary {
  Grid grid;
  std::string profile = "standard";  ///< of the rig
  std::vector<BenchPair> pairs;      ///< by scene and seed; only if both algorithms were run
  std::vector<FloodBias> flood;
  MeanRatio patterns_at_indirect, patterns_at_bar_indirect, patterns_at_both, indirect_at_patterns,
      frobenius_at_patterns;  ///< over all pairs
};

/// One summary for each profile and size, in the order of the plan. Failed captures are ignored.
std::vector<BenchSummary> summarize(const BenchRun& run);

/// The pairs of one scene.
std::vector<BenchPair> pairs_of(const BenchSummary& summary, const std::string& scene);
/// Geometric mean of one reading over the pairs.
MeanRatio mean_of(const std::vector<BenchPair>& pairs, CurveReading BenchPair::*reading);

}  // namespace symrig
