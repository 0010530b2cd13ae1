// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/paged_vector.hpp"
#include "symrig/image/image.hpp"
#include "symrig/tensor/block_tree.hpp"

#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace symrig::acquisition {

/// A photograph in tree order. mean, variance, valid: [channel][pixel].
struct TreePhotograph {
  PagedVector<float> pattern;  ///< what was lit, [pixel]
  PagedVector<float> mean, variance;
  PagedVector<std::uint8_t> valid;
};

/// Copies all but the pattern into tree order; pixels that are not valid become 0. False if a value that
/// claims to be valid is not finite.
bool to_tree(const BlockTree& tree, const Radiance& from, TreePhotograph& to);

/// What is not known of where photographs look, as variance: σ² / 2 · Σ (P_i − P_n)² over the four
/// neighbours n of pixel i. A shift by d moves the light of a strip of width d from one neighbour into the
/// pixel, and a strip of the pixel's light out on the other side. The sign of d is not known, so both
/// neighbours along an axis count half. Neighbours that are not valid, or of another view, do not count.
///
/// sigma: such as Probe::residual_shift(). Above 0, or nothing happens.
void add_shift_variance(const BlockTree& tree, double sigma, std::span<TreePhotograph> photographs);

/// Of a residual shift, what the tensor cannot hold. All photographs have the same shift, so most of it is
/// light between neighbours. A test of nodes counts this share of sigma as noise, by measurement
/// (docs/research/cells-of-a-finer-camera.md, Residual shift).
constexpr double kNotDescribed = 0.25;

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
struct BlockColumn {
  std::vector<std::int32_t> pixels;
  std::vector<float> values;
};

/// Light within this many standard deviations of zero counts as noise.
constexpr float kGateSigmas = 3;

/// The pixels of `seen` whose light stands out of its noise in at least one channel. The sign does not
/// matter: differences of photographs have light of both signs. A pixel without noise counts unless it is
/// zero.
BlockColumn significant_column(const TreePhotograph& photograph, const PixelSet& seen, int channels);

}  // namespace symrig::acquisition
