// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/search/photographer.hpp"

#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace symrig::acquisition {

/// Camera pixels, in tree order.
struct PixelSet {
  std::vector<std::int32_t> pixels;

  static PixelSet all(Grid grid) {
    PixelSet set{std::vector<std::int32_t>(grid.size())};
    std::iota(set.pixels.begin(), set.pixels.end(), 0);
    return set;
  }
};

/// The photograph of one lit block, where it is not noise: a column of T. values: [pixel][channel].
struct SparseColumn {
  std::vector<std::int32_t> pixels;
  std::vector<float> values;
};

/// Light within this many standard deviations of zero counts as noise.
constexpr float kGateSigmas = 3;

/// The pixels of `seen` whose light stands out of its noise in at least one channel. The sign does not
/// matter: differences of photographs have light of both signs. A pixel without noise counts unless it is
/// zero.
SparseColumn significant_column(const TreePhotograph& photograph, const PixelSet& seen, int channels);

}  // namespace symrig::acquisition
