// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/tree/tree_photograph.hpp"
#include "symrig/acquisition/error_estimate.hpp"
#include "symrig/base/paged_vector.hpp"
#include "symrig/tensor/block_tree.hpp"

#include <cstddef>
#include <span>
#include <vector>

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

/// A photograph of even light, or a sum of some. [channel][pixel] in tree order.
struct Flood {
  PagedVector<double> mean, variance;
  PagedVector<char> valid;
};

/// The level of a photograph over that of another, and how well it is known.
struct FloodLevel {
  double value = 1, sigma = 0;
};

/// Σ products of standardized differences of pixels side by side, and of their squares.
struct NeighbourProducts {
  double right = 0, below = 0, squares = 0;
  std::size_t pairs = 0;
};

/// Compares photographs of even light, whose difference holds nothing but noise and the lamp. They are added
/// one by one, so that few are in memory.
class FloodNoise {
 public:
  explicit FloodNoise(const BlockTree& tree) : tree_(tree) {}

  /// photograph: of all pixels lit, in the order in which they were taken.
  void add(const TreePhotograph& photograph);
  /// half, other: photographs of a pattern and its complement, or none. [docs/research/error-estimates.md]
  NoiseCheck judge(const TreePhotograph* half, const TreePhotograph* other,
                   const NoiseEvidence& besides = {}) &&;

 private:
  Flood mean_away();

  const BlockTree& tree_;
  std::size_t taken_ = 0;
  Flood first_, before_, sum_;
  Scatter between_;
  NeighbourProducts neighbours_;
  std::vector<FloodLevel> levels_;
};

/// By how much estimates should doubt the stated variance: 1 where nothing was found.
double doubted_variance(const NoiseCheck& check);

/// The change of the lamp, if it is a finding; else 0.
double changed_lamp(const NoiseCheck& check);

}  // namespace symrig::acquisition
