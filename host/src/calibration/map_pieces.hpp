// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/position_blocks.hpp"

namespace symrig::calibration {

/// The parts of a map that edges separate: decoded blocks without an edge that touch along a side.
class MapPieces {
 public:
  static constexpr int kNone = -1;
  /// A smaller piece has no model: 100 blocks, 40 × 40 pixels.
  static constexpr std::size_t kLeast = 100;

  MapPieces(const PositionBlocks& blocks, const Image<Around>& around);

  int count() const { return count_; }
  /// The piece of a block, from 0; kNone if it has none.
  int at(int row, int col) const { return number_.at(row, col); }

 private:
  Image<int> number_;
  int count_ = 0;
};

}  // namespace symrig::calibration
