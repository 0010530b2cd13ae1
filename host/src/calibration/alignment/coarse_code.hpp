// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/calibration/alignment.hpp"
#include "symrig/calibration/gray_code.hpp"
#include "symrig/image/image.hpp"
#include "symrig/image/outline.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
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

/// A border between two blocks, where it crosses the line between the middles of two camera pixels.
struct CoarseEdge {
  Point at;                            ///< [pixels]
  int row = 0, col = 0;                ///< of the first pixel
  bool down = false;                   ///< the second pixel is the one below, not the one to the right
  StripeAxis axis = StripeAxis::rows;  ///< the coordinate of the cells that the border has
  int border = 0;                      ///< between blocks `border` − 1 and `border`
};

/// What the camera's pixels see of a coarse code, one channel.
class CoarsePixels {
 public:
  /// photographs: of code.patterns(). Both must outlive this.
  CoarsePixels(const CoarseCode& code, std::span<const Radiance> photographs, int channel);

  Grid camera() const { return camera_; }
  /// The pixel sees stripes: bright enough, valid in all photographs, and its light follows the patterns.
  bool good(int row, int col) const { return block_of(row, col, StripeAxis::rows) >= 0; }
  /// The block that a pixel sees along an axis, by the signs of the patterns; −1: it sees no stripes.
  int block_of(int row, int col, StripeAxis axis) const {
    return blocks_.at(row, col, axis == StripeAxis::rows ? 0 : 1);
  }
  /// The light of a pattern less that of its complement, as a share of both, −1 to 1.
  double ratio(int row, int col, int pair) const;
  /// The pattern that has a border.
  int pair_of(StripeAxis axis, int border) const;

  /// All borders between neighbouring pixels that see neighbouring blocks. The place is where the light of
  /// the pattern with this border is that of its complement, linearly between the two pixels. That is right
  /// to a tenth of a pixel, and on average over a border that crosses pixels anywhere.
  std::vector<CoarseEdge> edges() const;

 private:
  std::array<std::int8_t, 2> decode(int row, int col) const;
  void add_edge(int row, int col, bool down, StripeAxis axis, std::vector<CoarseEdge>& edges) const;

  const CoarseCode& code_;
  std::span<const Radiance> photographs_;
  int channel_;
  Grid camera_;
  Image<std::int8_t> blocks_;  // row, column
};

/// Photographs of the coarse code that cannot be those of its patterns: dark, inverted, of other patterns, or
/// all alike. Nothing is assumed of the map; each bit of the code lights about half of the cells. The error
/// is wrong_light, with what was measured and the causes that fit.
std::optional<Error> wrong_light_of(const CoarseCode& code, std::span<const Radiance> photographs,
                                    int channel);

/// The same for a camera that has a pixel for each cell, and sees the cells mirrored or turned.
std::optional<Error> wrong_turn_of(const Alignment& alignment);

}  // namespace symrig::calibration
