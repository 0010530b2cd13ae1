// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/errors/checks.hpp"
#include "acquisition/tree/node.hpp"
#include "symrig/acquisition/error_estimate.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <array>
#include <cstddef>
#include <span>
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
  /// do not show the shape, and smaller ones cost time.
  void add(const NodeLevel& level);

  /// Least squares, robustly: where a leaf's photographs hold other light, a ratio is far off.
  GainMismatch fit() const;

 private:
  static constexpr std::size_t kUnknowns = kGainShapes + 1;  ///< the shapes, and the veil
  struct Pair {
    std::array<double, kUnknowns> slope{};
    double log_ratio = 0, variance = 0;
    std::size_t node = 0;                 ///< channels of a node have one number
    std::array<std::size_t, 2> blocks{};  ///< each block of each level has a number of its own
  };
  bool pair_of(const NodeLevel& level, const Node& node, int channel, std::span<const double> own,
               Pair& pair) const;
  GainShapes mean_shape(std::span<const float> light, const Block& block, double sum) const;

  const BlockTree& tree_;
  std::vector<GainShapes> shapes_;  ///< in tree order; empty until a level needs them
  std::vector<Pair> pairs_;
  std::size_t nodes_ = 0, blocks_ = 0;  ///< that were looked at
};

/// A photograph in a sum of check photographs of a set.
struct WeightedCheck {
  std::size_t photograph;
  double weight;
};

/// ε ∘ T̃p and T̃(ε ∘ p) at a sample. Their product is how much the square of the error exceeds that of the
/// residual there.
struct GainLight {
  double here = 0, there = 0;
};

/// What a mismatch of gains does to the check photographs. The rig shows (1 + ε) K with a symmetric K, and a
/// symmetric tensor holds T̃_ij ≈ (1 + (ε_i + ε_j) / 2) K_ij. So a residual is (ε ∘ T̃p − T̃(ε ∘ p)) / 2, and
/// the error is (ε ∘ T̃p + T̃(ε ∘ p)) / 2. It is larger where ε is alike, as for direct light.
class GainError {
 public:
  /// No mismatch is known.
  GainError() = default;
  /// photographs: of a set. mismatch: found or not.
  /// cost: two applies for each photograph and channel, if it was found.
  GainError(const TransportTensor& tensor, std::span<const TreePhotograph* const> photographs,
            const GainMismatch& mismatch);

  /// Of a sum of photographs. 0 if no mismatch was found. at: [channel][pixel].
  GainLight light(std::span<const WeightedCheck> sum, std::size_t at) const;
  /// The share of itself to which the product is known (one sigma): it is a product of two ε.
  double doubt() const { return doubt_; }

 private:
  struct Seen {
    PagedVector<float> here, there;  ///< ε ∘ T̃p and T̃(ε ∘ p), [channel][pixel]
  };
  std::vector<Seen> seen_;  // empty: no mismatch
  double doubt_ = 0;
};

}  // namespace symrig::acquisition
