// SPDX-License-Identifier: Apache-2.0
// How a test knows that a photograph of a virtual rig is of the right pattern.
#pragma once

#include "symrig/sim/virtual_rig.hpp"
#include "symrig/testing/probe_laws.hpp"

#include <cmath>
#include <cstdint>
#include <vector>

namespace symrig::test {

/// Patterns, each with half of the pixels lit. Half the pixels of each are others than of any other, so that
/// a photograph of the wrong one shows.
inline std::vector<Pattern> distinct_patterns(Grid grid, int count, std::uint64_t first_seed) {
  std::vector<Pattern> patterns;
  for (std::uint64_t i = 0; i < static_cast<std::uint64_t>(count); ++i)
    patterns.push_back(probe_laws::law_pattern(grid, first_seed + i));
  return patterns;
}

/// Mean over n pixels of (photograph - T p)² / Var: 1 ± √(2/n) for the right pattern. In a wrong one half the
/// pixels lie hundreds of sigmas away.
inline double misfit(const VirtualRig& rig, const Pattern& pattern, const Radiance& photograph) {
  const Image<float> truth = rig.truth().apply(pattern);
  double sum = 0;
  std::int64_t count = 0;
  for (std::size_t i = 0; i < truth.values().size(); ++i) {
    if (photograph.valid.values()[i] == 0) continue;
    const double off = photograph.mean.values()[i] - truth.values()[i];
    sum += off * off / photograph.variance.values()[i];
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : INFINITY;
}

}  // namespace symrig::test
