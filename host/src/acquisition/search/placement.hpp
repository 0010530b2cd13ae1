// SPDX-License-Identifier: Apache-2.0
// Where nodes go: into the known transport as leaves, scalars or empties, or into the next level.
#pragma once

#include "acquisition/search/known_transport.hpp"
#include "acquisition/search/node.hpp"
#include "acquisition/search/scene_facts.hpp"

#include <array>
#include <cstdint>
#include <span>

namespace symrig::acquisition {

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
struct Estimate {
  std::span<const float> c, r;
  std::span<const PairNoise> c_noise, r_noise;
  double undecayed = 0;
  bool distrusted = false;
};

/// Stores a node as a rank-1 leaf T_IJ ≈ (c/√s)(r/√s)'. Returns its number in known.
std::int32_t add_leaf(const SceneFacts& facts, KnownTransport& known, const NodeLevel& level,
                      const Node& node);

/// Stores a diagonal node as direct light alone: T_ii = c_i.
void add_direct(const SceneFacts& facts, KnownTransport& known, const NodeLevel& level, const Node& node);

/// A new node is stored as empty, stored as a scalar, or goes into its level.
void place(const SceneFacts& facts, KnownTransport& known, NodeLevel& into, std::int32_t row,
           std::int32_t col, const Estimate& estimate);

/// Tested nodes that are leaves are stored; the others leave their children in `next`.
void settle(const SceneFacts& facts, KnownTransport& known, const NodeLevel& level,
            std::span<const Tested> tested, NodeLevel& next);

/// The transport of a leaf becomes unknown again: a node of its level, which is split whatever its test
/// finds.
void reopen(const SceneFacts& facts, KnownTransport& known, std::int32_t leaf, NodeLevel& level);

}  // namespace symrig::acquisition
