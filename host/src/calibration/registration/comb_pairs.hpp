// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/cell_weights.hpp"
#include "symrig/calibration/optics_blur.hpp"
#include "symrig/image/radiance.hpp"

#include <algorithm>
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

}  // namespace symrig::calibration
