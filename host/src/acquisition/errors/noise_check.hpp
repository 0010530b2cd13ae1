// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/search/tree_photograph.hpp"
#include "symrig/acquisition/noise_check.hpp"
#include "symrig/tensor/block_tree.hpp"

#include <cstddef>
#include <span>

namespace symrig::acquisition {

/// Differences of photographs that should be equal: Σ d², Σ v and Σ 2 v² of what they state.
struct Scatter {
  double squares = 0, variance = 0, variance_squared = 0;
  std::size_t samples = 0;

  void add(double d, double v) {
    squares += d * d;
    variance += v;
    variance_squared += v * v;
    ++samples;
  }
};

/// What a capture that ends by brute force has besides, in place of further flood-lit photographs.
struct NoiseEvidence {
  std::span<const TreePhotograph> parts{};  ///< photographs of patterns that add up to all pixels
  Scatter mirrored{};  ///< entries of T against their mirror images, each from the photograph of one pixel
};

/// photographs: of all pixels lit; half, other: photographs of a pattern and its complement, or none.
/// [decisions/error-estimates.md]
NoiseCheck check_noise(const BlockTree& tree, std::span<const TreePhotograph> photographs,
                       const TreePhotograph* half, const TreePhotograph* other,
                       const NoiseEvidence& besides = {});

/// By how much estimates should doubt the stated variance: 1 where nothing was found.
double doubted_variance(const NoiseCheck& check);

}  // namespace symrig::acquisition
