// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/search/node.hpp"
#include "symrig/acquisition/gain_mismatch.hpp"

#include <array>
#include <cstddef>
#include <vector>

namespace symrig::acquisition {

/// The light that pairs of blocks exchange, both ways, from the photographs of a search.
///
/// A node's c is the light of J seen on I, and its r that of I seen on J. With a symmetric K and g = c / p,
/// the ratio of the gains of camera and projector,
///
///   log(Σc / Σr) = Σ_s shape_s (⟨φ_s⟩_I − ⟨φ_s⟩_J) + veil (D_J |I| / Σc − D_I |J| / Σr) / N
///
/// ⟨φ⟩: the mean of a shape over a block, by the light that it receives. D: light of a block on itself, whose
/// veiling glare all N pixels see. Blocks that touch do not count: there, registration and blur matter.
class GainEvidence {
 public:
  explicit GainEvidence(const BlockTree& tree);

  /// Adds the nodes of a level that are bright both ways. Only levels with 16 to 256 blocks: larger blocks
  /// tell no shape, and smaller ones cost time.
  void add(const NodeLevel& level);

  /// Least squares, robustly: where a leaf's photographs hold other light, a ratio is far off.
  GainMismatch fit() const;

 private:
  static constexpr std::size_t kUnknowns = kGainShapes + 1;  ///< the shapes, and the veil
  struct Pair {
    std::array<double, kUnknowns> slope{};
    double log_ratio = 0, variance = 0;
    std::size_t node = 0;  ///< channels of a node have one number
    std::array<std::size_t, 2>
        blocks{};  ///< what exchanges the light, each with a number of its own in all levels
  };
  bool pair_of(const NodeLevel& level, const Node& node, int channel, std::span<const double> own,
               Pair& pair) const;
  GainShapes mean_shape(std::span<const float> light, const Block& block, double sum) const;

  const BlockTree& tree_;
  std::vector<GainShapes> shapes_;  ///< in tree order; empty until a level needs them
  std::vector<Pair> pairs_;
  std::size_t nodes_ = 0, blocks_ = 0;  ///< that were looked at
};

}  // namespace symrig::acquisition
