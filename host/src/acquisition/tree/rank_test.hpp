// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/capture.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

namespace symrig::acquisition {

/// Photographs compared with an estimate: sums over samples and channels. Each channel is divided by the
/// square of its F, the RMS of the flood-lit photograph. So a colour cast does not move a threshold.
struct Comparison {
  double misfit = 0;  ///< E = Σ (measured − estimate)²
  double signal = 0;  ///< S = Σ measured²
  double noise = 0;   ///< V = Σ variance of (measured − estimate): the photographs' and the estimate's own
  double samples = 0;       ///< n: valid samples compared
  double signal_noise = 0;  ///< Σ variance of measured alone: what noise adds to the signal

  Comparison& operator+=(const Comparison& other) {
    misfit += other.misfit;
    signal += other.signal;
    noise += other.noise;
    samples += other.samples;
    signal_noise += other.signal_noise;
    return *this;
  }
  /// Signal without what its noise adds.
  double energy() const { return signal > signal_noise ? signal - signal_noise : 0; }
  /// Misfit without what noise adds.
  double excess() const { return misfit > noise ? misfit - noise : 0; }
};

/// [a][b]: child a of the row block and child b of the column block.
using PairTable = std::array<std::array<Comparison, 4>, 4>;

/// A node's child photographs compared with its rank-1 estimate c r'/s.
struct RankEvidence {
  PairTable on_row{};  ///< child b of the column block lit, seen on child a of the row block
  PairTable
      on_col{};  ///< child a of the row block lit, seen on child b of the column block; none on the diagonal
  bool diagonal = false;

  Comparison total() const;
  /// Child pair (a, b) seen from both sides.
  Comparison pair(int a, int b) const;
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
bool fits_rank1(const Comparison& evidence, const RankRule& rule);

/// One child pair carries more than g of the energy on both sides. Then the other children are dark, and the
/// estimate equals the one bright photograph by construction. The misfit is near zero whatever the rank, so
/// such a node must not be a leaf. Departs from [Garg06 §5.2], whose test accepts it
/// (docs/research/rank-test.md).
bool concentrated(const RankEvidence& evidence, const RankRule& rule);

/// |c|² + |r|² ≤ n τ_E² + V (1 + k √(2/n)): nothing to store.
bool is_empty(const Energy& energy, const RankRule& rule);

/// A leaf by all tests.
bool is_leaf(const RankEvidence& evidence, const RankRule& rule);

/// The misfit that a test of child pair (a, b) of a failed node at `level` is expected to find, as a mean
/// square in units of F². It lacks the factor ρ² that Decay learns:
///   √(e² m),  e² = mean square of the parent's misfit in the pair beyond noise,  m = √(mean c² · mean r²)
/// The geometric mean of misfit and signal predicts better than either alone. The result is ∞, so that the
/// pair must be tested, in two cases:
/// - The pair carries more than `dominance` of its parent's energy on both sides. There the parent's estimate
///   fits by construction.
/// - An unbroken misfit would do too much harm: e > risk · 2^level τ_A. A block of the next level has
/// 4^-level
///   of the pixels. So this bounds the energy that one wrong acceptance can misplace, whatever its size.
/// A diagonal parent has no misfit to go by: s² m, s = diagonal_spread. Its diagonal children must be tested.
double undecayed_misfit(const RankEvidence& parent, int a, int b, int level, const RankRule& rule,
                        const Economy& economy);

/// How much of the undecayed misfit a test is expected to find: ρ². For smooth transport a rank-1 misfit
/// falls by a steady factor a level. Idle colours test some nodes that were expected to pass: a sample of
/// those that were not tested. If their mean square misfit is above the tolerance (shadow edges, mirrors), ρ²
/// grows in proportion, and more nodes are tested. If it is below, ρ² falls again, down to where it began.
class Decay {
 public:
  explicit Decay(double initial) : squared_(initial * initial), least_(initial * initial) {}

  /// found: Σ misfit / tolerance (mean squares) of `nodes` nodes.
  void learn(double found, double nodes) {
    constexpr double kHold = 8;  // nodes' worth of doubt about a sample
    squared_ = std::max(least_, squared_ * (found + kHold) / (nodes + kHold));
  }
  double squared() const { return squared_; }

 private:
  double squared_, least_;
};

}  // namespace symrig::acquisition
