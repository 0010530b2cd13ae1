// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/search/known_transport.hpp"
#include "acquisition/search/photographer.hpp"

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

}  // namespace symrig::acquisition
