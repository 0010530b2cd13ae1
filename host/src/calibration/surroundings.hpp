// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/footprint.hpp"
#include "symrig/tensor/block_tree.hpp"

#include <vector>

namespace symrig::calibration {

/// The projector divided into the blocks of one level of its tree: rows × columns of them.
class Surroundings {
 public:
  /// Uses the level whose block width is nearest to `size` pixels.
  Surroundings(const BlockTree& tree, int size);

  int rows() const { return static_cast<int>(row_starts_.size()) - 1; }
  int cols() const { return static_cast<int>(col_starts_.size()) - 1; }
  std::size_t index(int row, int col) const {
    return static_cast<std::size_t>(row) * (col_starts_.size() - 1) + static_cast<std::size_t>(col);
  }
  /// Tree range of block (row, col).
  const Block& block(int row, int col) const { return *blocks_[index(row, col)]; }

  /// Means of a pattern that changes along one axis, one for each block of that axis.
  std::vector<float> column_means(std::span<const float> values) const { return means(values, col_starts_); }
  std::vector<float> row_means(std::span<const float> values) const { return means(values, row_starts_); }

  /// The weights of blocks in the surroundings of a position: linear between the two nearest centres.
  Taps column_taps(double position) const { return linear_taps(position, col_centres_); }
  Taps row_taps(double position) const { return linear_taps(position, row_centres_); }

 private:
  static std::vector<float> means(std::span<const float> values, const std::vector<int>& starts);
  static Taps linear_taps(double position, const std::vector<double>& centres);

  std::vector<int> row_starts_, col_starts_;  // first pixel of each block along the axis, and the end
  std::vector<double> row_centres_, col_centres_;
  std::vector<const Block*> blocks_;
};

}  // namespace symrig::calibration
