// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/tree/known_transport.hpp"
#include "acquisition/tree/node.hpp"
#include "acquisition/tree/search_facts.hpp"
#include "symrig/tensor/block_tree.hpp"

#include <array>
#include <cstdint>
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

// Where nodes go: into the known transport as leaves, scalars or empties, or into the next level.

/// A node of a level that was tested, and the result.
struct Tested {
  std::int32_t node = 0;
  bool leaf = false;  ///< by all tests
  Comparison total;   ///< of the evidence
  std::array<double, 16>
      undecayed{};  ///< of child pair (a, b) at 4a + b, unless it is a leaf (Node::undecayed)
};

/// The images of a new node, channel after channel. c is seen on its row block, r on its column block; r is
/// empty on the diagonal. With the noise of each channel, and with what a test is expected to find
/// (Node::undecayed).
struct NodeEstimate {
  std::span<const float> c, r;
  std::span<const PairNoise> c_noise, r_noise;
  double undecayed = 0;
  bool distrusted = false;
};

/// Stores a node as a rank-1 leaf T_IJ ≈ (c/√s)(r/√s)'. Returns its number in known.
std::int32_t add_leaf(const SearchFacts& facts, KnownTransport& known, const NodeLevel& level,
                      const Node& node);

/// Stores a diagonal node as direct light alone: T_ii = c_i.
void add_direct(const SearchFacts& facts, KnownTransport& known, const NodeLevel& level, const Node& node);

/// A new node is stored as empty, stored as a scalar, or goes into its level.
void place(const SearchFacts& facts, KnownTransport& known, NodeLevel& into, std::int32_t row,
           std::int32_t col, const NodeEstimate& estimate);

/// Tested nodes that are leaves are stored; the others leave their children in `next`.
void settle(const SearchFacts& facts, KnownTransport& known, const NodeLevel& level,
            std::span<const Tested> tested, NodeLevel& next);

/// The transport of a leaf becomes unknown again: a node of its level, which is split whatever its test
/// finds.
void reopen(const SearchFacts& facts, KnownTransport& known, std::int32_t leaf, NodeLevel& level);

}  // namespace symrig::acquisition
