// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/refine/level_light.hpp"
#include "acquisition/search/known_transport.hpp"
#include "acquisition/search/photographer.hpp"

#include <span>
#include <vector>

namespace symrig::acquisition {

/// Refines the diagonal of T, the light that comes straight back, from every photograph in which a pixel was
/// lit:
///   d_i += Σ_k w_ik p_ik e_ik / Σ_k w_ik p_ik²,   e = what the known transport leaves,  w = 1 / (Var +
///   misfit²)
/// This is the least-squares step in each d_i alone. One photograph of a level holds a pixel's direct light
/// once. All levels together hold it many times, so its shot noise falls as 1/√(times lit).
class DirectLight {
 public:
  /// What known transport may miss in a sample, as mean squares per channel: in every sample, and in a sample
  /// of a photograph with half the pixels lit. The second grows with the square of the lit share. A flood-lit
  /// photograph holds all light that was left out; so that light does not move into the direct light.
  struct Model {
    std::vector<double> least, half;
  };
  DirectLight(const KnownTransport& known, std::size_t pixels, Model model);

  /// Adds photographs from which the known transport has been subtracted.
  void add(std::span<const TreePhotograph> residuals);
  /// Adds the samples of a level; later: of the transport that is known now.
  void add(const LevelLight& level, const LaterLight& later, const KnownTransport& known);
  /// Moves the diagonal entries of `known`.
  void apply(KnownTransport& known) const;

 private:
  double variance(std::size_t at, double measured, double share) const;

  std::vector<std::int32_t> entry_;  // scalar number of each pixel's diagonal entry; -1: none
  Model model_;
  std::vector<double> weighted_residual_, weight_;  // [channel][pixel]
};

}  // namespace symrig::acquisition
