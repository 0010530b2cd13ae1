// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/report/bench.hpp"
#include "symrig/report/speed_error.hpp"

#include <string>
#include <vector>

namespace symrig {

/// `symrig` against `paper` on one scene and seed. The reference is `paper` at its default tolerance. It is
/// compared with the lower envelope of symrig's captures of the same scene, size and seed.
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
MeanRatio mean_of(const std::vector<BenchPair>& pairs, Reading BenchPair::*reading);

}  // namespace symrig
