// SPDX-License-Identifier: Apache-2.0
#include "calibration/camera_optics/combs.hpp"
#include "calibration/fitting/least_squares.hpp"
#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <Eigen/Dense>

namespace symrig::calibration {
namespace {

/// [cells] The least side of a tile, and the most tiles along a side of the grid: solving takes the cube of
/// their number.
constexpr int kTile = 8, kMostTiles = 24;
/// A tile needs this many pairs of cells.
constexpr int kLeastPairs = 12;
/// Tiles that are off by more robust sigmas are mirrors and depth edges.
constexpr double kOutlier = 5;
/// [tiles] Over which the field changes. Lenses and depth change it slowly, and a map follows what is slower.
constexpr double kLength = 2;
/// The covariance of neighbours must exceed its noise by this many sigmas.
constexpr double kSigmas = 2;

/// Sums over the pairs of a tile: m = √(A A′), d = a − a′, y = f − g. A is all light of a cell: a, and what
/// crosses its two borders. A camera that looks δ cells beside its map sees δ A more of it across one border,
/// and as much less across the other.
struct Tile {
  double mm = 0, md = 0, dd = 0, my = 0, dy = 0, yy = 0;
  int pairs = 0;
};

/// What a tile shows.
struct Shown {
  int row, col;
  double shift, variance;
};

int tile_side(Grid cells) {
  const int longest = std::max(cells.rows, cells.cols);
  return std::max(kTile, (longest + kMostTiles - 1) / kMostTiles);
}

/// Least squares in each tile, after the slope that all tiles share.
std::vector<Shown> shown_by(const std::vector<Tile>& tiles, Grid grid) {
  double slope = 0, spread = 0;
  for (const Tile& t : tiles) {
    if (t.pairs < kLeastPairs) continue;
    slope += t.dy - t.md * t.my / t.mm, spread += t.dd - t.md * t.md / t.mm;
  }
  const double k = spread > 0 ? slope / spread : 0;
  std::vector<Shown> shown;
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) {
      const Tile& t = tiles[static_cast<std::size_t>(row) * grid.cols + col];
      if (t.pairs < kLeastPairs) continue;
      const double shift = (t.my - k * t.md) / t.mm;
      // Σ (y − δ m − κ d)²
      const double rest =
          t.yy + shift * shift * t.mm + k * k * t.dd + 2 * (shift * k * t.md - shift * t.my - k * t.dy);
      shown.push_back({row, col, shift, std::max(rest, 0.0) / (t.pairs - 1) / t.mm});
    }
  return shown;
}

void leave_out_outliers(std::vector<Shown>& shown) {
  std::vector<double> shifts;
  shifts.reserve(shown.size());
  for (const Shown& s : shown) shifts.push_back(s.shift);
  const double middle = median(shifts), sigma = robust_sigma(shifts, middle);
  std::erase_if(shown, [&](const Shown& s) { return std::abs(s.shift - middle) > kOutlier * sigma; });
}

/// The variance of the field: what neighbours have in common. 0 if that is not above its noise; `noise` is
/// the standard deviation of it.
double common_variance(std::span<const Shown> shown, double& noise) {
  double sum = 0, squares = 0, weights = 0;
  for (std::size_t i = 0; i < shown.size(); ++i)
    for (std::size_t j = i + 1; j < shown.size(); ++j) {
      const Shown &a = shown[i], &b = shown[j];
      if (std::abs(a.row - b.row) + std::abs(a.col - b.col) != 1) continue;
      const double variance = a.variance * b.variance;
      if (!(variance > 0)) continue;
      const double weight = 1 / std::sqrt(variance);
      sum += weight * a.shift * b.shift, squares += weight * weight * variance, weights += weight;
    }
  noise = weights > 0 ? std::sqrt(squares) / weights : 0;
  const double common = weights > 0 ? sum / weights : 0;
  return common > kSigmas * noise ? common : 0;
}

double kernel(Point a, Point b) {
  return std::exp(-0.5 * (std::pow(a.row - b.row, 2) + std::pow(a.col - b.col, 2)) / (kLength * kLength));
}

}  // namespace

// The steps:
// 1. Sums over the pairs of cells of each tile, for f − g = δ √(A A′) + κ (a − a′).
// 2. shown_by: κ of all tiles, then δ of each, and its variance from what is left. Outliers go.
// 3. common_variance: the covariance of neighbouring tiles is that of the field, because their noise is
//    independent.
// 4. The field is a Gaussian process with covariance K(a, b) = v exp(−|a − b|² / 2 l²), v from step 3 and l
//    = kLength. With the tiles' variances Σ, its mean is K (K + Σ)⁻¹ δ, and tr(K − K (K + Σ)⁻¹ K) is what
//    stays unknown.
ShiftField::ShiftField(std::span<const Radiance> combs, const Image<std::uint8_t>& seen, bool rows,
                       std::span<const int> channels)
    : side_(tile_side(seen.grid())) {
  const Grid grid{(seen.grid().rows + side_ - 1) / side_, (seen.grid().cols + side_ - 1) / side_};
  std::vector<Tile> tiles(static_cast<std::size_t>(grid.size()));
  for (const int channel : channels)
    each_comb_pair(combs, seen, rows, channel, [&](const CombPair& p) {
      Tile& t = tiles[static_cast<std::size_t>(p.row / side_) * grid.cols + p.col / side_];
      const double crossing = std::max(0.0, p.here + p.next);
      const double m = std::sqrt((p.own + crossing) * (p.next_own + crossing));
      const double d = p.own - p.next_own, y = p.here - p.next;
      t.mm += m * m, t.md += m * d, t.dd += d * d, t.my += m * y, t.dy += d * y, t.yy += y * y;
      ++t.pairs;
    });
  std::vector<Shown> shown = shown_by(tiles, grid);
  leave_out_outliers(shown);
  double noise = 0;
  const double variance = common_variance(shown, noise);
  const auto n = static_cast<Eigen::Index>(shown.size());
  if (n == 0) return;
  for (const Shown& s : shown) at_.push_back({s.row + 0.5, s.col + 0.5});

  // The mean and the variance of the Gaussian process at the tiles. A field that was not found may be as
  // large as what would have been found.
  const double prior = variance > 0 ? variance : kSigmas * noise;
  Eigen::MatrixXd covariance(n, n);
  Eigen::VectorXd values(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    values[i] = shown[i].shift;
    for (Eigen::Index j = 0; j < n; ++j) covariance(i, j) = prior * kernel(at_[i], at_[j]);
  }
  Eigen::MatrixXd whole = covariance;
  for (Eigen::Index i = 0; i < n; ++i) whole(i, i) += shown[i].variance;
  Eigen::MatrixXd right(n, n + 1);
  right << covariance, values;
  const Eigen::MatrixXd left = solve_normal(whole, right);
  const double not_known = covariance.trace() - covariance.cwiseProduct(left.leftCols(n).transpose()).sum();
  unknown_ = std::sqrt(std::max(0.0, not_known / static_cast<double>(n)));
  if (variance == 0) return;
  const Eigen::VectorXd solved = left.col(n);
  size_ = (covariance * solved).norm() / std::sqrt(static_cast<double>(n));
  weight_.resize(shown.size());
  for (Eigen::Index i = 0; i < n; ++i) weight_[i] = prior * solved[i];
}

double ShiftField::operator()(Point cell) const {
  double sum = 0;
  const Point at{cell.row / side_, cell.col / side_};
  for (std::size_t i = 0; i < weight_.size(); ++i) sum += weight_[i] * kernel(at, at_[i]);
  return sum;
}

}  // namespace symrig::calibration
