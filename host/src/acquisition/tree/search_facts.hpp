// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/capture.hpp"
#include "symrig/tensor/block_tree.hpp"

#include <cmath>
#include <vector>

namespace symrig::acquisition {

/// How much coarser than options.rule a budget makes a level. It has steps, so that a log can hold it
/// exactly.
struct Coarseness {
  int steps = 0;  ///< of half as much again

  /// Of the misfit that a leaf may have.
  double factor() const { return std::pow(1.5, steps); }
};

/// What is known of a scene before it is searched.
struct SearchFacts {
  const CaptureSettings& options;
  const BlockTree& tree;
  int channels;
  std::vector<double> flood_squared;  ///< F² of each channel; F: RMS of the flood-lit photograph
  double residual_shift = 0;          ///< of all photographs [pixels] (Probe::residual_shift)
  Coarseness coarseness = {};         ///< of the level that is searched (BudgetTolerance)

  /// The rule of the level that is searched.
  RankRule rule() const {
    RankRule coarser = options.rule;
    coarser.flood_fraction *= coarseness.factor();
    return coarser;
  }
  /// τ_A², the mean square misfit that a leaf of this level may have, in units of F².
  double tolerance() const {
    const double fraction = options.rule.flood_fraction * coarseness.factor();
    return fraction * fraction;
  }
};

}  // namespace symrig::acquisition
