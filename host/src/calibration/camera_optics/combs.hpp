// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/camera_optics.hpp"
#include "symrig/calibration/cell_weights.hpp"
#include "symrig/image/image.hpp"
#include "symrig/image/outline.hpp"

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace symrig::calibration {

/// Two cells next to each other along an axis, as the combs of that axis show them.
struct CombPair {
  int row, col;            ///< of the first cell
  int next_row, next_col;  ///< of the second one
  /// Their own light: of each while it is lit, less the light under the comb that is farthest away.
  double own, next_own;
  double here, next;  ///< f: light of the second cell seen in the first one; g: the reverse
  double variance;    ///< of f − g
};

/// Calls visit(pair) for all pairs along an axis whose cells are seen, valid and lit. combs: on the cells.
template <class Visit>
void each_comb_pair(std::span<const Radiance> combs, const Image<std::uint8_t>& seen, bool rows, int channel,
                    const Visit& visit) {
  constexpr int period = CombPhotographs::period;
  const Grid grid = seen.grid();
  const int down = rows ? 1 : 0, right = rows ? 0 : 1;
  const auto comb = [&](int row, int col, int ahead) -> const Radiance& {
    return combs[((rows ? row : col) + ahead) % period];
  };
  const auto light = [&](int row, int col, int ahead) {
    return static_cast<double>(comb(row, col, ahead).mean.at(row, col, channel));
  };
  const auto variance = [&](int row, int col, int ahead) {
    return static_cast<double>(comb(row, col, ahead).variance.at(row, col, channel));
  };
  for (int row = 0; row + down < grid.rows; ++row)
    for (int col = 0; col + right < grid.cols; ++col) {
      const int r = row + down, q = col + right;
      const bool good = seen.at(row, col) != 0 && seen.at(r, q) != 0 &&
                        std::ranges::all_of(combs, [&](const Radiance& one) {
                          return one.valid.at(row, col, channel) != 0 && one.valid.at(r, q, channel) != 0;
                        });
      if (!good) continue;
      const double far = light(row, col, 2), far_next = light(r, q, 2);
      // The cell before a cell is three ahead, because combs repeat after four.
      const CombPair pair{
          .row = row,
          .col = col,
          .next_row = r,
          .next_col = q,
          .own = light(row, col, 0) - far,
          .next_own = light(r, q, 0) - far_next,
          .here = light(row, col, 1) - far,
          .next = light(r, q, 3) - far_next,
          .variance = variance(row, col, 1) + variance(r, q, 3) + variance(row, col, 2) + variance(r, q, 2)};
      if (pair.own > 0 && pair.next_own > 0) visit(pair);
    }
}

/// The photographs on the cells of `weights`.
inline Result<std::vector<Radiance>> gathered(const CellWeights& weights,
                                              std::span<const Radiance> photographs) {
  std::vector<Radiance> cells;
  cells.reserve(photographs.size());
  for (const Radiance& photograph : photographs) {
    SYMRIG_TRY(Radiance one, weights.gather(photograph));
    cells.push_back(std::move(one));
  }
  return cells;
}

/// What the camera's pixels see of the combs. All without a ghost.
struct CombPixels {
  Grid cells;
  std::span<const CornerMap> corners;  ///< one for each channel, or one for all
  const Radiance& flood;               ///< on the camera's grid
  const CombPhotographs& combs;
};

/// Tells the blurs of camera and projector apart, pixel by pixel.
///
/// The camera blurs the product of what the projector shows, s, and the scene's texture ρ. For a Gaussian of
/// variance q, the mean of a product is
///
///   G[ρ s] = Σ_n qⁿ / n! · ∂ⁿG[ρ] · ∂ⁿG[s] = W S + q W′ S′ + q² / 2 · W″ S″ + …
///
/// W = G[ρ] is the flood-lit photograph, so the texture need not be known; S is the comb with both blurs, of
/// variance b. Each tile of 8 × 8 cells has a factor (the direct light's share) and a shift of its own. Least
/// squares, robustly, give b and q for all of them: b by how wide borders are, q by how texture near a border
/// shows. The error is the scatter between tiles. first: of measure_blur(); it is the prior of q. Returns
/// `first` if there are too few pixels.
OpticsBlur fit_comb_blur(const CombPixels& pixels, const OpticsBlur& first);

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
