// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/search/rank_test.hpp"

#include <algorithm>

namespace symrig::acquisition {

/// What testing child pair (a, b) of a failed node at `level` is expected to find, but for the decay ρ² that
/// Decay learns: mean square misfit in units of F².
///   √(e² m),  e² = mean square of the parent's misfit in the pair beyond noise,  m = √(mean c² · mean r²)
/// The geometric mean of misfit and signal predicts better than either alone. ∞, so that it must be tested,
/// - where the pair carries more than `dominance` of its parent's energy on both sides: there the parent's
/// estimate fits by
///   construction;
/// - where an unbroken misfit would do too much harm: e > risk · 2^level τ_A. A block of the next level has
/// 4^-level of the
///   pixels, so this bounds the energy that a single wrong acceptance can misplace, whatever its size.
/// A diagonal parent has no misfit to go by: s² m, s = diagonal_spread; its diagonal children must be tested.
double undecayed_misfit(const RankEvidence& parent, int a, int b, int level, const RankRule& rule,
                        const Economy& economy);

/// How much of the undecayed misfit a test is expected to find: ρ². For smooth transport a rank-1 misfit
/// falls by a steady factor a level. Nodes that were expected to pass and were tested all the same, because
/// idle colours had room for them, are a sample of those that were not: if their mean square misfit is above
/// the tolerance (shadow edges, mirrors), ρ² grows in proportion and more nodes are tested; if it is below,
/// ρ² falls again, down to where it began.
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
