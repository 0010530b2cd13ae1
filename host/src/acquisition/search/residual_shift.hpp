// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/search/tree_photograph.hpp"
#include "symrig/tensor/block_tree.hpp"

#include <span>

namespace symrig::acquisition {

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

}  // namespace symrig::acquisition
