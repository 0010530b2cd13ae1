// SPDX-License-Identifier: Apache-2.0
#include "calibration/camera_fit/pixel_fitter.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace symrig::calibration {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kFloor = 3e-5;    ///< of its flood-lit light: what the model may miss in every photograph
constexpr double kDarkest = 1e-2;  ///< of a cell's light: a pixel is not known better than this one

constexpr int kMostFound = 24;         ///< cells that a search adds
constexpr double kGain = 25;           ///< a cell must lower the misfit's sum by so many variances
constexpr double kGainShare = 0.02;    ///< and by this share of it
constexpr double kExplained = 0.2;     ///< of the misfit is left, or what was found is chance
constexpr int kAround = 6, kSpot = 4;  ///< [cells] of this cell, and of a partner
constexpr std::size_t kMostCandidates = 4096;

}  // namespace

void PixelFitter::begin(std::int32_t cell) {
  cell_ = cell;
  candidates_.clear();
  listed_ = false;
  prior_.begin(cell, blur_);
  const auto& columns = prior_.columns();
  x_.resize(static_cast<Index>(shown_.photographs), static_cast<Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k)
    x_.col(static_cast<Index>(k)) =
        Eigen::Map<const Eigen::VectorXf>(shown_.of(columns[k]), x_.rows()).cast<double>();
}

std::vector<float> PixelFitter::most_shown() const {
  std::vector<float> most;
  for (Index k = 0; k < x_.cols(); ++k) most.push_back(static_cast<float>(x_.col(k).cwiseAbs().maxCoeff()));
  return most;
}

// The row of a pixel is what its photographs and the prior make likeliest: the minimum over d of
//
//   Σ_j (y_j − x_jᵀ (m + S d))² / v_j + |d|²,    m + S d ≥ 0 for light from single cells
//
// v_j: the stated variance and the floor of the model. Each pixel weighs its photographs by its own noise: in
// a photograph that leaves it dark, its noise is a hundredth of that in the flood-lit one, and such
// photographs show the faint light of far cells.
void PixelFitter::weigh(const PixelLight& pixel) {
  prior_.of_pixel(pixel.footprint, pixel.flood, foretold_, sigma_);
  const Index photographs = x_.rows(), columns = x_.cols();
  root_.resize(photographs);
  const double least = kFloor * std::max(pixel.flood, kDarkest * prior_.brightness());
  const double floor = least * least;
  for (Index j = 0; j < photographs; ++j)
    root_(j) = pixel.weight[j] > 0 ? 1 / std::sqrt(1 / static_cast<double>(pixel.weight[j]) + floor) : 0;
  photographs_ = std::max(static_cast<double>((root_.array() > 0).count()), 1.0);
  rest_.noalias() = -x_ * foretold_;
  for (Index j = 0; j < photographs; ++j) rest_(j) += pixel.mean[j];
  rest_.array() *= root_.array();
  weighted_ = root_.asDiagonal() * x_ * sigma_.asDiagonal();
  least_.resize(columns);
  for (Index k = 0; k < columns; ++k) {
    const bool bounded = prior_.single(k) && sigma_(k) > 0;
    least_(k) = bounded ? std::min(-foretold_(k) / sigma_(k), 0.0) : -std::numeric_limits<double>::infinity();
  }
  found_.clear();
  operations_ = 0;
}

void PixelFitter::solve() {
  operations_ += weighted_.cols() * weighted_.cols() * weighted_.rows() / 2;
  normal_.setIdentity(weighted_.cols(), weighted_.cols());
  normal_.selfadjointView<Eigen::Lower>().rankUpdate(weighted_.transpose());
  right_.noalias() = weighted_.transpose() * rest_;
  d_ = solver_.solve(normal_, right_, least_);
  left_ = rest_;
  left_.noalias() -= weighted_ * d_;
  misfit_ = (left_.squaredNorm() + d_.squaredNorm()) / photographs_;
}

FittedRow PixelFitter::fitted() const {
  FittedRow result{cell_, misfit_, {}, {}};
  const Index columns = x_.cols();
  result.row.resize(columns);
  Eigen::Map<Eigen::VectorXf>(result.row.data(), columns) =
      (foretold_ + sigma_.cwiseProduct(d_.head(columns))).cast<float>();
  return result;
}

double PixelFitter::light_of(const PixelLight& pixel) {
  prior_.of_pixel(pixel.footprint, prior_.brightness(), foretold_, sigma_);
  rest_.noalias() = x_ * foretold_;
  // In units of the cell's light: 1 ± 1 before any photograph, because a pixel that is clipped whenever it is
  // lit has none but dark ones.
  constexpr double kLeast = 0.1, kMost = 10;
  double both = 1, squares = 1;
  const double floor = std::pow(kFloor * prior_.brightness(), 2);
  for (Index j = 0; j < x_.rows(); ++j) {
    if (!(pixel.weight[j] > 0)) continue;
    const double weight = 1 / (1 / static_cast<double>(pixel.weight[j]) + floor);
    both += weight * static_cast<double>(pixel.mean[j]) * rest_(j);
    squares += weight * rest_(j) * rest_(j);
  }
  return prior_.brightness() * std::clamp(both / squares, kLeast, kMost);
}

FittedRow PixelFitter::fit(const PixelLight& pixel) {
  weigh(pixel);
  solve();
  return fitted();
}

/// Cells near partners of this cell and of those around it, the nearest first.
void PixelFitter::list_candidates() {
  const Grid grid = rows_.grid();
  const int row = cell_ / grid.cols, col = cell_ % grid.cols;
  std::vector<char> listed(grid.size());
  for (const CameraTransport::Column column : columns())
    if (column < 0) listed[-1 - column] = 1;
  const auto add_spot = [&](std::int32_t middle) {
    const int y = middle / grid.cols, x = middle % grid.cols;
    for (int v = std::max(y - kSpot, 0); v <= std::min(y + kSpot, grid.rows - 1); ++v)
      for (int u = std::max(x - kSpot, 0); u <= std::min(x + kSpot, grid.cols - 1); ++u)
        if (char& one = listed[std::size_t{1} * v * grid.cols + u]; one == 0) {
          one = 1;
          candidates_.push_back(v * grid.cols + u);
        }
  };
  for (int ring = 0; ring <= kAround && candidates_.size() < kMostCandidates; ++ring)
    for (int y = std::max(row - ring, 0); y <= std::min(row + ring, grid.rows - 1); ++y)
      for (int x = std::max(col - ring, 0); x <= std::min(col + ring, grid.cols - 1); ++x)
        if (std::max(std::abs(y - row), std::abs(x - col)) == ring)
          for (const std::int32_t partner : rows_.partners(y * grid.cols + x))
            if (candidates_.size() < kMostCandidates) add_spot(partner);
}

/// The candidate whose light, of any strength, would lower the sum most; −1: none by least_gain.
std::int32_t PixelFitter::best_cell(double least_gain) const {
  const VectorXd weighted = left_.cwiseProduct(root_), squares = root_.cwiseAbs2();
  std::int32_t best = -1;
  for (const std::int32_t cell : candidates_) {
    const Eigen::Map<const Eigen::VectorXf> x(shown_.of(-1 - cell), x_.rows());
    const double both = x.cast<double>().dot(weighted);
    if (!(both > 0)) continue;
    const double gain = both * both / x.cast<double>().cwiseAbs2().dot(squares);
    if (gain < least_gain || std::ranges::find(found_, cell) != found_.end()) continue;
    least_gain = gain;
    best = cell;
  }
  return best;
}

void PixelFitter::add_column(std::int32_t cell, double spread) {
  const Index k = weighted_.cols();
  weighted_.conservativeResize(Eigen::NoChange, k + 1);
  weighted_.col(k) =
      spread *
      root_.cwiseProduct(Eigen::Map<const Eigen::VectorXf>(shown_.of(-1 - cell), x_.rows()).cast<double>());
  least_.conservativeResize(k + 1);
  least_(k) = 0;
  found_.push_back(cell);
}

// A curved mirror shows each pixel other cells than its neighbours, and sends its light to single pixels.
// Then the cell of the pixel foretells nothing of it, but the mirror's partners lie near those of the cells
// around. So the cell that explains most of what is left is added, again and again (orthogonal matching
// pursuit [Pati93]). A wrong outline or shadow leaves a misfit too, which no few cells explain: such
// cells are not kept.
FittedRow PixelFitter::fit_and_search(const PixelLight& pixel) {
  weigh(pixel);
  solve();
  FittedRow plain = fitted();
  if (!(pixel.flood > 0)) return plain;
  if (!listed_) list_candidates();
  listed_ = true;
  while (found_.size() < kMostFound) {
    operations_ += std::ssize(candidates_) * x_.rows();
    const std::int32_t cell = best_cell(std::max(kGain, kGainShare * misfit_ * photographs_));
    if (cell < 0) break;
    add_column(cell, pixel.flood);
    solve();
  }
  if (found_.empty() || misfit_ > kExplained * plain.misfit) return plain;
  FittedRow result = fitted();
  for (std::size_t k = 0; k < found_.size(); ++k)
    result.found.push_back(
        {found_[k], static_cast<float>(pixel.flood * d_(x_.cols() + static_cast<Index>(k)))});
  return result;
}

}  // namespace symrig::calibration
