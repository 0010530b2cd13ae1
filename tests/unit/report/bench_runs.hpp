// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/report/bench.hpp"

/// Benches made by hand: no capture is run.
namespace symrig::test {

inline BenchCapture captured(const BenchCase& what, std::int64_t patterns, double indirect,
                             double bar_indirect, double frobenius) {
  BenchCapture capture;
  capture.what = what;
  capture.patterns = patterns;
  capture.frames = 4 * patterns;
  capture.rig_seconds = static_cast<double>(patterns);
  capture.rig_time = {0.75 * capture.rig_seconds, 0.15 * capture.rig_seconds, 0.1 * capture.rig_seconds};
  capture.process_seconds = 0.5;
  capture.merge_seconds = 0.25;
  capture.wall_seconds = 2;
  capture.tensor_bytes = 1000 * patterns;
  capture.error.indirect = indirect;
  capture.error.bar_indirect = bar_indirect;
  capture.error.frobenius = frobenius;
  capture.error.flood = 2 * frobenius;
  return capture;
}

/// One scene, two seeds. Paper takes 400 patterns at its default and leaves 0.01, 0.02, 0.03. symrig's sweep:
/// 100 patterns at 0.1, 0.01, 0.03 and 400 patterns at 0.001, 0.005, 0.003; a capture between them that errs
/// more than both.
inline BenchRun small_run() {
  BenchRun run;
  run.plan.scenes = {"gummy"};
  run.plan.sizes = {{16, 16}};
  run.plan.seeds = {1, 2};
  run.plan.sweeps = {{Algorithm::paper, {3e-4}, 3e-4}, {Algorithm::symrig, {1e-3, 3e-4}, 3e-4}};
  for (const int seed : run.plan.seeds) {
    BenchCase what{.scene = "gummy", .grid = {16, 16}, .seed = seed, .algorithm = Algorithm::paper};
    what.tolerance = 3e-4;
    what.preset = true;
    run.captures.push_back(captured(what, 400, 0.01, 0.02, 0.03));
    what.algorithm = Algorithm::symrig;
    run.captures.push_back(captured(what, 400, 0.001, 0.005, 0.003));
    what.preset = false;
    what.tolerance = 5e-4;
    run.captures.push_back(captured(what, 200, 0.5, 0.5, 0.5));
    what.tolerance = 1e-3;
    run.captures.push_back(captured(what, 100, 0.1, 0.01, 0.03));
  }
  run.planned = run.captures.size();
  return run;
}

}  // namespace symrig::test
