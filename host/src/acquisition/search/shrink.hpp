// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/tensor/block_tree.hpp"

#include <span>

namespace symrig::acquisition {

/// Takes noise out of an image of one block, as far as the image cannot be distinguished from noise. The
/// image is split by scale: means of blocks, level by level, less the mean of the block around (a Haar
/// transform on the tree). Noise of variance v a pixel explains a part of the p numbers d of one scale. They
/// are shrunk by it:
///   d ← d · max(0, 1 − (p − 2) v / Σ n d²),   n: pixels of the block that d is of
/// This is Stein's estimator [James & Stein 1961], positive part. Its expected square error is never above
/// that of d itself, whatever the image. Pure noise becomes its mean: the sum of the image stays, and with it
/// the light that a leaf carries. image: pixels of `block` (of that level of the tree), tree order, in and
/// out. v: variance of a pixel.
void shrink_noise(const BlockTree& tree, int level, const Block& block, double variance,
                  std::span<float> image);

/// Whether that is worth its time: noise is more than a quarter of the image's energy. Above, no scale that
/// matters would shrink by much, and every leaf would take a fifth longer.
bool is_noisy(std::span<const float> image, double variance);

}  // namespace symrig::acquisition
