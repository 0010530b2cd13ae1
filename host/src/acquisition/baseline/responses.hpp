// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/search/photographer.hpp"

#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace symrig::acquisition {

/// Camera pixels (tree order) that a photograph is looked at in.
struct Seen {
  std::vector<std::int32_t> pixels;

  static Seen all(Grid grid) {
    Seen seen{std::vector<std::int32_t>(static_cast<std::size_t>(grid.size()))};
    std::iota(seen.pixels.begin(), seen.pixels.end(), 0);
    return seen;
  }
};

/// What some camera pixels answered to one lit block. values: [pixel][channel].
struct Responses {
  std::vector<std::int32_t> pixels;
  std::vector<float> values;
};

/// Light within so many standard deviations of zero is taken for noise.
constexpr float kGateSigmas = 3;

/// The baselines' noise gate: a response counts if any channel is beyond 3 σ of its own noise (not zero where
/// there is none), either way: photographs that are differences of others have light of both signs.
Responses significant_responses(const TreePhotograph& photograph, const Seen& seen, int channels);

}  // namespace symrig::acquisition
