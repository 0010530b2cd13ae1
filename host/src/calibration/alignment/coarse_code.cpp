// SPDX-License-Identifier: Apache-2.0
#include "calibration/alignment/coarse_code.hpp"

#include <algorithm>

namespace symrig::calibration {
namespace {

/// Narrower blocks have no pixels that see one block only, if the camera has a pixel for each cell.
constexpr int kNarrowest = 4;

Grid block_of(Grid cells) {
  const auto side = [](int count) {
    return std::max(kNarrowest, (count + CoarseCode::kBlocks - 1) / CoarseCode::kBlocks);
  };
  return {side(cells.rows), side(cells.cols)};
}

Grid blocks_of(Grid cells, Grid block) {
  return {(cells.rows + block.rows - 1) / block.rows, (cells.cols + block.cols - 1) / block.cols};
}

}  // namespace

CoarseCode::CoarseCode(Grid cells)
    : cells_(cells), block_(block_of(cells)), code_(blocks_of(cells, block_of(cells))) {}

std::vector<Pattern> CoarseCode::patterns() const {
  std::vector<Pattern> patterns;
  const auto add = [&](int photograph) {
    const Pattern of_blocks = code_.pattern(photograph);
    Pattern pattern(cells_, 1);
    for (int row = 0; row < cells_.rows; ++row)
      for (int col = 0; col < cells_.cols; ++col)
        pattern.at(row, col) = of_blocks.at(row / block_.rows, col / block_.cols);
    patterns.push_back(std::move(pattern));
  };
  for (int pair = 0; pair < code_.pairs(); ++pair) add(2 * pair);
  add(code_.white());
  add(code_.black());
  return patterns;
}

}  // namespace symrig::calibration
