// SPDX-License-Identifier: Apache-2.0

#include "symrig/acquisition/evaluate.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/base/time.hpp"
#include "symrig/report/bench.hpp"
#include "symrig/sim/scene.hpp"

#include <algorithm>
#include <cstddef>
#include <fstream>
#include <functional>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/partitioner.h>
#include <unistd.h>

namespace symrig {

namespace {

/// All tolerances from large to small, each once, with the default tolerance of the reference.
std::vector<double> tolerances_of(const BenchSweep& sweep) {
  std::vector<double> all = sweep.tolerances;
  if (algorithm_info(sweep.algorithm).reference && sweep.preset > 0) all.push_back(sweep.preset);
  std::sort(all.begin(), all.end(), std::greater<>());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

void add_sweep(const BenchSweep& sweep, const BenchPlan& plan, BenchCase what,
               std::vector<BenchCase>& cases) {
  what.algorithm = sweep.algorithm;
  if (!algorithm_info(sweep.algorithm).tolerance) {
    what.preset = true;
    if (what.grid.size() <= plan.brute_pixels) cases.push_back(what);
    return;
  }
  for (const double tolerance : tolerances_of(sweep)) {
    what.tolerance = tolerance;
    what.preset = tolerance == sweep.preset;
    cases.push_back(what);
  }
}

}  // namespace

std::vector<BenchCase> bench_cases(const BenchPlan& plan) {
  std::vector<BenchCase> cases;
  for (const std::string& profile : plan.profiles)
    for (const Grid size : plan.sizes)
      for (const std::string& scene : plan.scenes)
        for (const int seed : plan.seeds)
          for (const BenchSweep& sweep : plan.sweeps)
            add_sweep(sweep, plan, {.scene = scene, .grid = size, .seed = seed, .profile = profile}, cases);
  return cases;
}

std::string bench_rig(const BenchPlan& plan, const BenchCase& what) {
  SceneUri uri;
  uri.name = what.scene;
  uri.size = what.grid;
  uri.seed = what.seed;
  uri.channels = plan.channels;
  uri.profile = what.profile;
  uri.camera_noise = plan.camera_noise;
  if (!plan.camera_noise) uri.black = 0;  // as in a rig without noise
  return uri.to_string();
}

namespace {

/// The size for the first processor, "32768K" in the file. sysconf gives the sum over caches that one core
/// cannot use. 0 if the system does not report it.
std::int64_t last_level_cache() {
  std::ifstream file("/sys/devices/system/cpu/cpu0/cache/index3/size");
  std::int64_t number = 0;
  char unit = 0;
  if (!(file >> number >> unit)) return 0;
  return unit == 'K' ? number << 10 : unit == 'M' ? number << 20 : 0;
}

std::int64_t array_bytes_of(const RelightSpeedOptions& options) {
  constexpr std::int64_t kLeast = std::int64_t{128} << 20;
  if (options.array_bytes > 0) return options.array_bytes;
  return std::max(kLeast, 4 * last_level_cache() + (std::int64_t{1} << 20));
}

Error no_memory(std::int64_t array_bytes) {
  return {ErrorCode::limit,
          "memory speed cannot be measured: three arrays of " + std::to_string(array_bytes >> 20) +
              " MiB are more than half of this machine's memory",
          "do not measure it"};
}

/// a = b + s c over arrays that fit into no cache.
class Triad {
 public:
  static Result<Triad> with(std::int64_t array_bytes) {
    const std::int64_t memory = std::int64_t{sysconf(_SC_PHYS_PAGES)} * sysconf(_SC_PAGESIZE);
    if (3 * array_bytes > memory / 2) return no_memory(array_bytes);
    Triad triad(static_cast<std::size_t>(array_bytes) / sizeof(float));
    if (!triad.a_ || !triad.b_ || !triad.c_) return no_memory(array_bytes);
    triad.fill();
    return triad;
  }

  /// One pass; returns bytes per second.
  double rate() {
    const Stopwatch watch;
    over_elements([this](std::size_t i) { a_[i] = b_[i] + 3.0F * c_[i]; });
    return 3.0 * sizeof(float) * static_cast<double>(elements_) / watch.seconds();
  }

 private:
  using Array = std::unique_ptr<float[]>;
  static Array array(std::size_t elements) { return Array(new (std::nothrow) float[elements]); }
  explicit Triad(std::size_t elements)
      : elements_(elements), a_(array(elements)), b_(array(elements)), c_(array(elements)) {}

  template <class Body>
  void over_elements(const Body& body) {
    const auto chunk = [&body](const tbb::blocked_range<std::size_t>& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i) body(i);
    };
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, elements_), chunk, tbb::static_partitioner());
  }
  /// The first access decides the memory node of a page, so the threads that will use the pages fill them.
  void fill() {
    over_elements([this](std::size_t i) {
      a_[i] = 1;
      b_[i] = 2;
      c_[i] = 3;
    });
  }

  std::size_t elements_;
  Array a_, b_, c_;
};

/// Times of one number of threads, round by round.
class Rounds {
 public:
  explicit Rounds(int threads) : threads_(threads) {}

  Result<void> run(Triad& triad, const TransportTensor& tensor, const Image<float>& pattern) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads_));
    best_rate_ = std::max(best_rate_, triad.rate());  // this also clears the caches of the tensor
    const Stopwatch watch;
    SYMRIG_TRY(const Image<float> photograph, tensor.apply(pattern));
    relight_.push_back(watch.seconds());
    return {};
  }

  ThreadSpeed speed() { return {threads_, best_rate_, median(relight_)}; }

 private:
  int threads_;
  double best_rate_ = 0;
  std::vector<double> relight_;
};

}  // namespace

double RelightSpeed::share_of_triad(const ThreadSpeed& speed) const {
  const double whole = speed.relight_seconds * speed.triad_bytes_per_second;
  return whole > 0 ? static_cast<double>(tensor_bytes) / whole : 0;
}

Result<RelightSpeed> measure_relight(const TransportTensor& tensor, const RelightSpeedOptions& options) {
  if (options.rounds < 1)
    return Error{ErrorCode::bad_argument, "relighting cannot be timed in less than one round", "give rounds"};
  const std::int64_t array_bytes = array_bytes_of(options);
  SYMRIG_TRY(Triad triad, Triad::with(array_bytes));
  const Image<float> pattern = natural_pattern(tensor.projector_grid(), 1);
  Rounds one(1);
  Rounds all(tbb::info::default_concurrency());
  for (int round = 0; round < options.rounds; ++round) {
    if (options.progress && !options.progress({"memory speed", round, options.rounds, kNoneToCome}))
      return Error{ErrorCode::interrupted, "stopped while measuring memory speed", ""};
    SYMRIG_CHECK(one.run(triad, tensor, pattern));
    SYMRIG_CHECK(all.run(triad, tensor, pattern));
  }
  return RelightSpeed{array_bytes, tensor.bytes(), one.speed(), all.speed()};
}

}  // namespace symrig
