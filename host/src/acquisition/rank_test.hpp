// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/capture.hpp"

#include <array>
#include <cstdint>

namespace symrig::acquisition {

/// What a node's child photographs say about its rank-1 estimate, summed over the channels. Every quantity of
/// one channel is divided by the square of that channel's F, the RMS of the flood-lit photograph: a colour
/// cast does not move a threshold.
struct RankEvidence {
  double misfit = 0;  ///< E = Σ (measured − c r'1/s)² over all child photographs of both sides
  double signal = 0;  ///< S = Σ measured²
  double noise = 0;   ///< V = Σ variance of (measured − estimate): the photographs' and the estimate's own
  double samples = 0;                 ///< n: valid samples compared
  std::array<double, 4> row_child{};  ///< signal energy of each child of the row block, noise removed
  std::array<double, 4> col_child{};  ///< signal energy of each child of the column block, noise removed
};

/// Signal of a node before it is tested, in the same units.
struct Energy {
  double signal = 0;  ///< Σ c² + Σ r²
  double noise = 0;   ///< their variances, summed
  double samples = 0;
};

/// The misfit that noise alone explains: V (1 + k √(2/n)), mean plus k standard deviations of a χ² sum of n
/// equal terms; 0 when k = 0.
double noise_allowance(double noise, double samples, double sigmas);

/// E ≤ τ_R² S + n τ_A² + V (1 + k √(2/n)): the rank-1 test [Garg06 §5.2] with a relative, an absolute and a
/// noise term.
bool fits_rank1(const RankEvidence& evidence, const RankRule& rule);

/// One child pair carries more than g of the energy on both sides. Then the other children are dark, the
/// estimate equals the one bright photograph by construction, and the misfit is near zero whatever the rank:
/// such a node must not be a leaf. Departs from [Garg06 §5.2], whose test accepts it
/// (docs/decisions/rank-test.md).
bool concentrated(const RankEvidence& evidence, const RankRule& rule);

/// |c|² + |r|² ≤ n τ_E² + V (1 + k √(2/n)): nothing to store.
bool is_empty(const Energy& energy, const RankRule& rule);

/// A leaf by all tests.
bool is_leaf(const RankEvidence& evidence, const RankRule& rule);

}  // namespace symrig::acquisition
