// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/bench.hpp"
#include "symrig/sim/scene.hpp"

#include <algorithm>
#include <functional>

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

}  // namespace symrig
