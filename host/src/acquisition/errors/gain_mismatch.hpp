// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/errors/checks.hpp"
#include "symrig/acquisition/gain_mismatch.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <span>
#include <vector>

namespace symrig::acquisition {

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
