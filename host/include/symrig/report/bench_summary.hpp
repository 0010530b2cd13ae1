// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/report/bench.hpp"
#include "symrig/report/speed_error.hpp"

#include <string>
#include <vector>

namespace symrig {

/// `symrig` against `paper` on one scene and seed. The reference is `paper` at its own default tolerance;
/// what is read is the lower envelope of symrig's captures of the same scene, size and seed.
struct BenchPair {
  std::string scene;
  int seed = 1;
  double paper_patterns = 0;
  TransportErrors paper_error;
  // symrig's patterns / paper's, at paper's error:
  Reading patterns_at_indirect, patterns_at_bar_indirect, patterns_at_both;
  // symrig's error / paper's, at paper's patterns:
  Reading indirect_at_patterns, frobenius_at_patterns;
};

/// flood / frobenius over the captures of one algorithm on one scene: a bias under all-positive light that
/// random tests average away.
struct FloodBias {
  std::string scene;
  Algorithm algorithm = Algorithm::symrig;
  double at_preset = 0;  ///< worst over seeds at the default tolerance; 0 if it was not run
  double worst = 0;      ///< worst over the whole sweep
};

/// All of one size.
struct BenchSummary {
  Grid grid;
  std::vector<BenchPair> pairs;  ///< scene by scene, seed by seed; only where both algorithms were run
  std::vector<FloodBias> flood;
  MeanRatio patterns_at_indirect, patterns_at_bar_indirect, patterns_at_both, indirect_at_patterns,
      frobenius_at_patterns;  ///< over all pairs
};

/// One a size, in the order of the plan. Captures that failed take no part.
std::vector<BenchSummary> summarize(const BenchRun& run);

/// The pairs of one scene.
std::vector<BenchPair> pairs_of(const BenchSummary& summary, const std::string& scene);
/// Geometric mean of one of their readings over the seeds.
MeanRatio mean_of(const std::vector<BenchPair>& pairs, Reading BenchPair::*reading);

}  // namespace symrig
