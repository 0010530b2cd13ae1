// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/camera_fit/bounded_least_squares.hpp"
#include "calibration/camera_fit/cell_rows.hpp"
#include "calibration/camera_fit/footprint.hpp"
#include "calibration/camera_fit/row_prior.hpp"
#include "symrig/tensor/camera_transport.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace symrig::calibration {

/// What every photograph shows to each column, [columns × photographs].
struct Shown {
  std::size_t photographs = 0;
  std::vector<float> bases, cells;

  const float* of(CameraTransport::Column column) const {
    return column >= 0 ? &bases[column * photographs] : &cells[(-1 - column) * photographs];
  }
};

/// What is known of a pixel before its row.
struct PixelLight {
  Footprint footprint;
  double flood = 0;                     ///< its light in the flood-lit scene
  std::span<const float> mean, weight;  ///< of each photograph; weight: 1 / variance, 0 where it is not valid
};

/// The row of a pixel, made of the columns of a cell.
struct FittedRow {
  std::int32_t cell = 0;
  double misfit = 0;                   ///< the sum that it minimises, by the number of photographs
  std::vector<float> row;              ///< of each column of the cell
  std::vector<CellRows::Entry> found;  ///< light from single cells that are no columns of this cell
};

/// Fits the pixels of one cell after the other. It keeps its memory; each thread has one.
class PixelFitter {
 public:
  /// blur: as footprint_of().
  PixelFitter(const CellRows& rows, const Shown& shown, double blur)
      : rows_(rows), prior_(rows), shown_(shown), blur_(blur) {}

  /// To be called before the pixels of a cell are fitted.
  void begin(std::int32_t cell);
  /// Of the cell.
  const std::vector<CameraTransport::Column>& columns() const { return prior_.columns(); }
  /// The most that a photograph shows to each column.
  std::vector<float> most_shown() const;

  /// The flood-lit light of a pixel whose flood-lit photographs are clipped or missing: with it, the row of
  /// its cell is nearest to its other photographs. Without any: that of its cell.
  double light_of(const PixelLight& pixel);
  FittedRow fit(const PixelLight& pixel);
  /// The same, and searches for light that nothing foretells, if a few cells explain nearly all that the row
  /// does not.
  FittedRow fit_and_search(const PixelLight& pixel);
  /// That the last pixel took, for Work.
  std::int64_t operations() const { return operations_; }

 private:
  void weigh(const PixelLight& pixel);
  void solve();
  std::int32_t best_cell(double least_gain) const;
  void add_column(std::int32_t cell, double spread);
  FittedRow fitted() const;
  void list_candidates();

  const CellRows& rows_;
  RowPrior prior_;
  const Shown& shown_;
  double blur_;
  BoundedLeastSquares solver_;
  std::int32_t cell_ = 0;
  std::vector<std::int32_t> candidates_, found_;
  bool listed_ = false;
  std::int64_t operations_ = 0;
  double photographs_ = 0, misfit_ = 0;
  Eigen::MatrixXd x_, weighted_, normal_;
  Eigen::VectorXd foretold_, sigma_, root_, rest_, left_, right_, least_, d_;
};

}  // namespace symrig::calibration
