// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/gray_code.hpp"

#include <vector>

namespace symrig::calibration {

/// A Gray code of up to 8 × 8 blocks of cells, without the complements: white less a pattern is its
/// complement.
class CoarseCode {
 public:
  /// cells: at least kFewestCells along each axis.
  explicit CoarseCode(Grid cells);
  static constexpr int kBlocks = 8, kFewestCells = 12;

  /// The patterns on the cells: one for each bit, then white and black.
  std::vector<Pattern> patterns() const;
  const GrayCode& code() const { return code_; }
  Grid cells() const { return cells_; }
  Grid blocks() const { return code_.projector(); }
  /// Cells of a block. The last blocks may be smaller.
  Grid block() const { return block_; }
  std::size_t white() const { return static_cast<std::size_t>(code_.pairs()); }
  std::size_t black() const { return white() + 1; }

 private:
  Grid cells_, block_;
  GrayCode code_;
};

}  // namespace symrig::calibration
