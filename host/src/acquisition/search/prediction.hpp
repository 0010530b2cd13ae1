// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/search/rank_test.hpp"

#include <algorithm>

namespace symrig::acquisition {

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
