// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/statistics.hpp"
#include "symrig/calibration/pixel_map.hpp"
#include "symrig/image/outline.hpp"

#include <array>
#include <vector>

namespace symrig::calibration {

/// The mean of the decoded positions of a square of camera pixels.
struct PositionBlock {
  static constexpr int kSide = 4;                   ///< [camera pixels]
  static constexpr int kLeast = kSide * kSide / 2;  ///< with fewer decoded pixels it has no position

  /// [projector px] Error that neighbouring pixels have in common, by paint and by the shape of the
  /// footprint. The decoder's sigmas do not contain it. At this value, Tukey's biweight reaches half a
  /// projector pixel.
  static constexpr double kCommon = 0.5 / kTukeyReach;

  Point at;                          ///< the weighted middle of its decoded pixels
  std::array<double, 2> position{};  ///< column, row of the projector [px]
  std::array<double, 2> variance{};  ///< of these: the decoder's and kCommon²
  bool decoded = false;
};

/// The blocks of a map, in raster order.
class PositionBlocks {
 public:
  explicit PositionBlocks(const PixelMap& map);

  Grid grid() const { return grid_; }
  const PositionBlock& at(int row, int col) const {
    return blocks_[static_cast<std::size_t>(std::int64_t{row} * grid_.cols + col)];
  }
  /// Every other block, like the white squares of a chessboard. The others are left out, to judge by them.
  static bool is_known(int row, int col) { return (row + col) % 2 == 0; }

 private:
  Grid grid_;
  std::vector<PositionBlock> blocks_;
};

/// What the known blocks around a block say; the block itself does not count.
enum class Around : std::uint8_t {
  unknown,  ///< there are too few of them
  plane,    ///< they do not contradict one plane
  edge      ///< planes on both sides of a line through the block do not meet
};

/// Looks for edges of surfaces at each block. A line through the block divides the square of blocks within
/// kReach; blocks within kGap of the line do not count, because pixels at the border of black and white paint
/// are off by a part of a pixel. The planes through both sides differ at the block by more than kSigmas of
/// their own scatter, for one of four lines: an edge.
Image<Around> find_surface_edges(const PositionBlocks& blocks);

/// 1: find_surface_edges says plane here, and finds no edge within its reach.
Image<std::uint8_t> planar_blocks(const Image<Around>& around);

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
