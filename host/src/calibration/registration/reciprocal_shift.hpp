// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/optics_blur.hpp"
#include "symrig/image/outline.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::calibration {

/// How far the camera looks beside where its map says, along one axis, as combs show it by reciprocity.
///
/// T is symmetric, so the light f of the next cell seen in a cell equals its reverse g [Garg06 §3]. A camera
/// that looks δ cells beside its map sees more of the next cell and less of the last one:
///
///   f − g = δ √(A A′) + κ (a − a′)
///
/// with the cells' own light a and a′, and all of it, A and A′: with what crosses their borders. κ, one
/// number for the axis, is what unequal blur adds. δ is fitted in tiles of 8 × 8 cells. Neighbouring tiles
/// that err together show how large the field of shifts is; the rest is noise. The field is the mean of a
/// Gaussian process with that variance and a length of two tiles.
class ShiftField {
 public:
  /// combs: the four of this axis, on cells whose gain and blur are corrected. channels: those of one map.
  ShiftField(std::span<const Radiance> combs, const Image<std::uint8_t>& seen, bool rows,
             std::span<const int> channels);

  /// Whether neighbouring tiles err together by more than their noise.
  bool found() const { return !weight_.empty(); }
  /// [cells] At a point of the cells; 0 if nothing was found.
  double operator()(Point cell) const;
  /// [cells] rms of the field over the tiles, and of what is not known of it.
  double size() const { return size_; }
  double unknown() const { return unknown_; }

 private:
  int side_;                    ///< of a tile [cells]
  std::vector<Point> at_;       ///< the middle of each tile that is used [tiles]
  std::vector<double> weight_;  ///< of each
  double size_ = 0, unknown_ = 0;
};

}  // namespace symrig::calibration
