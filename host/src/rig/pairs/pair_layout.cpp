// SPDX-License-Identifier: Apache-2.0
#include "symrig/rig/pairs.hpp"

#include <fmt/format.h>

namespace symrig {

/// Rows of cells in the first column of pairs, and columns of cells in the first row of them.
Result<PairLayout> pair_layout(ViewLayout layout, std::span<const Grid> cells) {
  if (std::ssize(cells) != layout.count())
    return Error{ErrorCode::bad_argument,
                 fmt::format("a layout of {} pairs has {} places, but there are {} pairs", to_string(layout),
                             layout.count(), cells.size()),
                 "give rows x columns of pairs, such as \"1x2\""};
  PairLayout pairs{layout, {}};
  for (int row = 0; row < layout.rows; ++row)
    pairs.cells.rows += cells[static_cast<std::size_t>(row) * layout.cols].rows;
  for (int col = 0; col < layout.cols; ++col) pairs.cells.cols += cells[col].cols;
  for (std::size_t k = 0; k < cells.size(); ++k)
    if (!layout.fits(pairs.cells) || cells[k] != pairs.tile(k).grid)
      return Error{ErrorCode::size_mismatch,
                   fmt::format("pair {} has cells of {}, but pairs of {} tile a grid only with equal cells",
                               k + 1, to_string(cells[k]), to_string(layout)),
                   "give each pair the same grid"};
  return pairs;
}

}  // namespace symrig
