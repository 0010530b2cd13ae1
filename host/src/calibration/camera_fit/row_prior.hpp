// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/camera_fit/cell_rows.hpp"
#include "calibration/camera_fit/footprint.hpp"
#include "symrig/tensor/camera_transport.hpp"

#include <vector>

#include <Eigen/Core>

namespace symrig::calibration {

/// What T on the cells says of the rows of the pixels that look at one cell, before any photograph: which
/// columns they are made of, and how large each coefficient may be.
///
/// A pixel sees a part of its cell, so its row is that of the cell, brighter or darker by u = its flood-lit
/// light by the cell's. It differs where
///
/// - leaves: the part is not lit as the whole cell is: by as much as each coefficient is;
/// - direct light: it comes from the cells that the pixel itself looks at, by its footprint;
/// - cells nearby: light that goes a few cells changes over a cell by as much as it is in this one and its
///   neighbours;
/// - edges inside a cell: a mirrored cell ends anywhere in this one. So all cells around one that sends
/// strong
///   light here, or to a neighbour of this cell, may send as much to a single pixel. They have this width
///   whatever the cells' T says of them: a mirror's edge that misses the middle of the cells leaves them 0.
class RowPrior {
 public:
  explicit RowPrior(const CellRows& rows) : rows_(rows) {}

  /// Of the pixels of this cell. blur: as footprint_of.
  void begin(std::int32_t cell, double blur);
  const std::vector<CameraTransport::Column>& columns() const { return columns_; }
  /// The light of the cell.
  double brightness() const { return total_; }

  /// light: the flood-lit light of the pixel. mean, sigma: of its coefficients.
  void of_pixel(const Footprint& footprint, double light, Eigen::VectorXd& mean,
                Eigen::VectorXd& sigma) const;
  /// Whether a coefficient is light from a single cell, which is never negative.
  bool single(std::size_t column) const { return columns_[column] < 0; }

 private:
  /// One coefficient. u: the pixel's light by the cell's; W: its light; f: its footprint in the near cell.
  struct Term {
    double mean = 0, spread = 0;  ///< times u
    double least = 0;             ///< spread at least, times u
    double direct = 0;            ///< times W f
    int near = -1;                ///< number in the footprint; −1: not near
  };

  void add_leaves(std::int32_t cell);
  double near_light(int row, int col, int k) const;
  void add_near(std::int32_t cell, double blur);
  void add_singles(std::int32_t cell);
  void add_edges(std::int32_t cell);
  std::size_t number_of(std::int32_t cell);

  const CellRows& rows_;
  double total_ = 1;
  std::vector<CameraTransport::Column> columns_;
  std::vector<Term> terms_;
  std::vector<CellRows::Entry> edges_;                        // cells that an edge may show to a pixel
  std::vector<std::pair<std::int32_t, std::size_t>> placed_;  ///< single cells and their columns, sorted
};

}  // namespace symrig::calibration
