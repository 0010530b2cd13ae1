// SPDX-License-Identifier: Apache-2.0
#include "calibration/camera_optics/ghost_fit.hpp"

#include "calibration/cells/ghost_subtraction.hpp"
#include "calibration/fitting/least_squares.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/calibration/camera_optics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <vector>

#include <Eigen/Dense>

namespace symrig::calibration {
namespace {

/// More pixels cost time and tell nothing new.
constexpr double kMostPixels = 4e4;
/// [cells] Slopes are differences over twice this distance.
constexpr double kStep = 0.25;
/// [cells] The place moves at most so far in a round.
constexpr double kMostMotion = 0.5;
constexpr int kFitRounds = 10;

/// A dark pixel under one pattern.
struct Row {
  Eigen::Vector3d light;  ///< displaced photograph, and its slopes along rows and columns [1 / cell]
  double seen = 0;
};

/// The value that half of the weight does not exceed.
double weighted_median(std::vector<std::pair<double, double>> values) {
  std::ranges::sort(values);
  double half = 0;
  for (const auto& [value, weight] : values) half += 0.5 * weight;
  for (const auto& [value, weight] : values)
    if ((half -= weight) <= 0) return value;
  return 0;
}

class GhostRows {
 public:
  GhostRows(std::span<const Pattern> patterns, std::span<const Radiance> photographs,
            std::span<const CornerMap> corners)
      : photographs_(photographs), corners_(corners), dark_(dark_cells(patterns)) {
    const Image<float>& first = photographs.front().mean;
    stride_ =
        std::max(1, static_cast<int>(std::sqrt(static_cast<double>(first.values().size()) / kMostPixels)));
  }

  /// All dark pixels, for a ghost at this place.
  std::vector<Row> at(Point place) const;

 private:
  void add(int row, int col, int channel, Point place, std::vector<Row>& rows) const;
  static std::optional<Row> row_of(const PhotographPlane& plane, std::size_t pixel,
                                   std::span<const Point> from);

  std::span<const Radiance> photographs_;
  std::span<const CornerMap> corners_;
  std::vector<Image<std::uint8_t>> dark_;
  int stride_ = 1;
};

/// from: the places of the ghost, and of ghosts that are a step up, down, left and right of it.
std::optional<Row> GhostRows::row_of(const PhotographPlane& plane, std::size_t pixel,
                                     std::span<const Point> from) {
  if (!plane.valid[pixel]) return std::nullopt;
  std::array<double, 5> light{};
  for (std::size_t k = 0; k < light.size(); ++k) {
    const Mixed mixed = plane.at(static_cast<float>(from[k].row), static_cast<float>(from[k].col));
    if (!mixed.known) return std::nullopt;
    light[k] = static_cast<double>(mixed.mean);
  }
  return Row{{light[0], (light[2] - light[1]) / (2 * kStep), (light[4] - light[3]) / (2 * kStep)},
             static_cast<double>(plane.mean[pixel])};
}

void GhostRows::add(int row, int col, int channel, Point place, std::vector<Row>& rows) const {
  const CornerMap& corners = corners_[corners_.size() == 1 ? 0 : static_cast<std::size_t>(channel)];
  const Grid cells = dark_.front().grid();
  const double down = 0.5 * (corners.at(row, col, 0) + corners.at(row + 1, col + 1, 0));
  const double right = 0.5 * (corners.at(row, col, 1) + corners.at(row + 1, col + 1, 1));
  if (!(down >= 0 && right >= 0 && down < cells.rows && right < cells.cols)) return;
  const auto by = [&](double a, double b) {
    return displaced_pixel(corners, row, col, {place.row + a, place.col + b});
  };
  const std::array from{by(0, 0), by(-kStep, 0), by(kStep, 0), by(0, -kStep), by(0, kStep)};
  const auto pixel = static_cast<std::size_t>(std::int64_t{row} * (corners.grid().cols - 1) + col);
  const std::size_t first = rows.size();
  Row mean{Eigen::Vector3d::Zero(), 0};
  for (std::size_t k = 0; k < photographs_.size(); ++k) {
    if (!dark_[k].at(static_cast<int>(down), static_cast<int>(right))) continue;
    const auto one = row_of(plane_of(photographs_[k], channel), pixel, from);
    if (!one) continue;
    rows.push_back(*one);
    mean.light += one->light, mean.seen += one->seen;
  }
  const auto count = static_cast<double>(rows.size() - first);
  for (std::size_t k = first; k < rows.size(); ++k)
    rows[k].light -= mean.light / count, rows[k].seen -= mean.seen / count;
}

std::vector<Row> GhostRows::at(Point place) const {
  const Image<float>& first = photographs_.front().mean;
  std::vector<Row> rows;
  for (int c = 0; c < first.channels(); ++c)
    for (int row = 0; row < first.grid().rows; row += stride_)
      for (int col = 0; col < first.grid().cols; col += stride_) add(row, col, c, place, rows);
  return rows;
}

/// The share that half of the rows, by their light, exceed: least absolute deviations.
double first_share(const std::vector<Row>& rows) {
  std::vector<std::pair<double, double>> shares;
  for (const Row& row : rows)
    if (row.light[0] != 0) shares.emplace_back(row.seen / row.light[0], std::abs(row.light[0]));
  return weighted_median(std::move(shares));
}

/// One round of a robust regression on the light and the first `slopes` slopes. share: of the last round.
Eigen::Vector3d regress(const std::vector<Row>& rows, double share, bool slopes) {
  std::vector<std::pair<double, double>> off;
  off.reserve(rows.size());
  for (const Row& row : rows)
    off.emplace_back(std::abs(row.seen - share * row.light[0]), row.light[0] * row.light[0]);
  // Where no ghost can be, residuals tell nothing of its error.
  const double sigma = 1.4826 * weighted_median(off);
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const double weight = sigma > 0 ? tukey_weight(off[k].first / sigma) : 1;
    if (weight == 0) continue;
    Eigen::Vector3d light = rows[k].light;
    if (!slopes) light.tail<2>().setZero();
    normal += weight * light * light.transpose();
    right += weight * rows[k].seen * light;
  }
  const Eigen::Vector3d found = solve_shortest(normal, right);
  return found.allFinite() ? found : Eigen::Vector3d::Zero();
}

/// Of a ghost at a fixed place.
double share_at(const GhostRows& pixels, Point place) {
  const std::vector<Row> rows = pixels.at(place);
  double share = first_share(rows);
  for (int round = 0; round < kFitRounds; ++round) share = regress(rows, share, false)[0];
  return share;
}

/// y displaced is (1 − share) times the light that makes the ghost.
double of_light(double ratio) {
  return ratio / (1 + ratio);
}

}  // namespace

GhostFit fit_ghost(std::span<const Pattern> patterns, std::span<const Radiance> photographs,
                   std::span<const CornerMap> corners, Point place) {
  const GhostRows pixels(patterns, photographs, corners);
  std::optional<double> share;
  for (int round = 0; round < kFitRounds; ++round) {
    const std::vector<Row> rows = pixels.at(place);
    if (!share) share = first_share(rows);
    const Eigen::Vector3d found = regress(rows, *share, true);
    share = found[0];
    if (!(found[0] > 0)) break;
    place.row += std::clamp(found[1] / found[0], -kMostMotion, kMostMotion);
    place.col += std::clamp(found[2] / found[0], -kMostMotion, kMostMotion);
  }
  return {of_light(share_at(pixels, place)), of_light(share_at(pixels, {-place.row, -place.col})), place};
}

}  // namespace symrig::calibration
