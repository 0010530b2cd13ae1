// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/tensor/camera_transport.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace symrig::calibration {

/// A leaf of T seen from its rows: T_IJ = Σ_k a_k b_kᵀ with orthonormal b_k.
struct LeafRows {
  std::int32_t begin = 0, end = 0;  ///< I, in tree order
  LightBasis basis;                 ///< of J
  Eigen::MatrixXf a;                ///< [|I| × rank]
  Eigen::VectorXf rms;              ///< of each column of a
};

/// A row of a leaf.
struct LeafRow {
  std::int32_t leaf = 0, row = 0;
};

/// T on the cells, row by row, of one channel. Cells are in raster order.
class CellRows {
 public:
  /// Light from one cell.
  struct Entry {
    std::int32_t cell = 0;
    float value = 0;
  };
  /// The cells around a cell, up to two away, row by row; its own entry is in the middle.
  static constexpr int radius = 2, side = 2 * radius + 1;
  using Near = std::array<float, std::size_t{side} * side>;

  /// seen: of each cell, whether the camera sees it; nothing: all.
  /// bases, values: those of the channel are added. The values are halves, as CameraTransport has them, so
  /// what is fitted to them is not rounded later.
  /// work: may stop it.  throws: Stopped.
  static Result<CellRows> make(const TransportTensor& tensor, int channel, std::span<const std::uint8_t> seen,
                               std::vector<LightBasis>& bases, std::vector<float>& values,
                               const Work& work = {});

  Grid grid() const { return grid_; }
  /// If not, T tells of this cell only what others get from it: not its own light, nor how bright it is.
  bool seen(std::int32_t cell) const { return seen_.empty() || seen_[cell] != 0; }
  /// The light of the flood-lit scene in this cell.
  double total(std::int32_t cell) const { return total_[cell]; }
  /// The same, never below a small share of the mean: what light is compared with.
  double brightness(std::int32_t cell) const { return std::max(total_[cell], least_); }
  double diagonal(std::int32_t cell) const { return near_[cell][side * radius + radius]; }
  /// All light from near cells; 0 off the grid.
  const Near& near(std::int32_t cell) const { return near_[cell]; }
  /// Cells that are more than one away and give at least a fiftieth of the cell's light.
  std::span<const Entry> strong(std::int32_t cell) const { return part(strong_first_, strong_, cell); }
  /// Cells of which one is strong() for the other.
  std::span<const std::int32_t> partners(std::int32_t cell) const {
    return part(partner_first_, partner_, cell);
  }
  /// Light that no leaf holds: from the cell itself, its bands and single entries.
  std::span<const Entry> single(std::int32_t cell) const { return part(single_first_, single_, cell); }
  std::span<const LeafRow> leaves(std::int32_t cell) const { return part(leaf_first_, leaf_row_, cell); }
  const LeafRows& leaf(std::int32_t number) const { return leaves_[number]; }

 private:
  template <class T>
  static std::span<const T> part(const std::vector<std::int64_t>& first, const std::vector<T>& all,
                                 std::int32_t cell) {
    return std::span(all).subspan(first[cell], first[cell + 1] - first[cell]);
  }
  Result<void> take_leaves(const TransportTensor& tensor, int channel, std::vector<LightBasis>& bases,
                           std::vector<float>& values);
  void list_leaves(std::span<const std::int32_t> order);
  void take_singles(const TransportTensor& tensor, int channel);
  void list_partners();
  void sum_rows(std::span<const std::int32_t> order, std::span<const float> values, std::size_t first_value,
                const Work& work);

  Grid grid_;
  std::vector<std::uint8_t> seen_;
  std::vector<LeafRows> leaves_;
  std::vector<std::int64_t> leaf_first_, single_first_, strong_first_, partner_first_;
  std::vector<LeafRow> leaf_row_;
  std::vector<Entry> single_, strong_;
  std::vector<std::int32_t> partner_;
  std::vector<double> total_;
  double least_ = 1;
  std::vector<Near> near_;
};

}  // namespace symrig::calibration
