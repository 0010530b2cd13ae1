// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/tree/known_transport.hpp"
#include "acquisition/tree/photographer.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::acquisition {

/// The light of one level's photographs on the pixels that they light. A level lights a pixel at most once.
/// So one sample a pixel holds it all, and the photographs need not be read again for it.
///
/// Which light is in such a sample? Two blocks whose transport is unknown are never lit together. So the
/// light that the level leaves unknown reaches a lit pixel only from its own lit block, a child of a block of
/// the level. Transport that is found later belongs into the sample if and only if it lies within that child:
/// LaterLight.
struct LevelLight {
  LevelLight(int of_level, LogRange taken, std::size_t pixels, std::size_t channels)
      : level(of_level),
        photographs(taken),
        residual(channels * pixels),
        variance(channels * pixels, kNone),
        lit_share(pixels) {}

  static constexpr float kNone = -1;  ///< variance where there is no sample

  int level;
  LogRange photographs;
  PagedVector<float> residual, variance;  ///< [channel][pixel], known transport of the time subtracted
  PagedVector<float> lit_share;           ///< [pixel]: of the photograph that lit it

  /// Keeps what a photograph, in which a share of all pixels is lit, says of those in `lit`.
  void keep(const TreePhotograph& photograph, const LitBlocks& lit, float share);
};

/// Light that each pixel receives from the block around it when all of that block is lit. It counts the
/// transport that is known now, without the pixel's own direct light: [level of the block][channel][pixel].
class LaterLight {
 public:
  LaterLight(const KnownTransport& known, const BlockTree& tree, int channels);

  /// From the block of `level` around pixel t (index channel × pixels + t).
  float within(int level, std::size_t at) const { return within_[level][at]; }
  int levels() const { return static_cast<int>(within_.size()); }

 private:
  std::vector<PagedVector<float>> within_;
};

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
