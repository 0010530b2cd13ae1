// SPDX-License-Identifier: Apache-2.0
#include "calibration/fitting/least_squares.hpp"
#include "symrig/calibration/registration.hpp"

#include <cmath>

#include <Eigen/Dense>

namespace symrig {
namespace {

/// A picture that has lost more of its light is another picture.
constexpr double kDark = 0.1;

}  // namespace

double Motion::distance() const {
  return std::hypot(row, col);
}

std::array<Pattern, 2> MotionWatch::patterns(Grid cells) {
  constexpr int kWide = 2;
  std::array<Pattern, 2> patterns{Pattern(cells, 1), Pattern(cells, 1)};
  for (int row = 0; row < cells.rows; ++row)
    for (int col = 0; col < cells.cols; ++col) {
      patterns[0].at(row, col) = col / kWide % 2 == 0 ? 1.F : 0.F;
      patterns[1].at(row, col) = row / kWide % 2 == 0 ? 1.F : 0.F;
    }
  return patterns;
}

Result<Motion> MotionWatch::measure(Probe& rig) const {
  const std::array<Pattern, 2> stripes = patterns(cells_);
  SYMRIG_TRY(const auto now, rig.measure(stripes));
  return compare(now);
}

/// Least squares for brightness and the two components of the motion, in pixels: now = brightness · before +
/// down · ∂ before / ∂ row + right · ∂ before / ∂ column.
Result<Motion> MotionWatch::compare(std::span<const Radiance> now) const {
  const Grid camera = before_.grid();
  const int channels = before_.channels() / 2;
  // The slope between pixels of two colours is that of the filters, not of the picture.
  const int apart = mosaic_ == Mosaic::none ? 1 : 2;
  if (now.size() != 2)
    return Error{ErrorCode::size_mismatch, "motion is measured by two photographs of stripes",
                 "take one of each of MotionWatch::patterns()"};
  for (const Radiance& one : now)
    if (one.mean.grid() != camera || one.mean.channels() != channels)
      return Error{ErrorCode::size_mismatch, "the photographs of the stripes do not fit the registration",
                   "calibrate the rig again"};
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d noise = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < now.size(); ++k)
    for (int c = 0; c < channels; ++c) {
      const int plane = static_cast<int>(k) * channels + c;
      const auto was = [&](int row, int col) { return static_cast<double>(before_.at(row, col, plane)); };
      for (int row = apart; row + apart < camera.rows; ++row)
        for (int col = apart; col + apart < camera.cols; ++col) {
          if (!now[k].valid.at(row, col, c)) continue;
          const Eigen::Vector3d slope(was(row, col),
                                      (was(row + apart, col) - was(row - apart, col)) / (2 * apart),
                                      (was(row, col + apart) - was(row, col - apart)) / (2 * apart));
          // Every pixel counts the same: dark ones have less noise, but no edges.
          normal += slope * slope.transpose();
          right += slope * static_cast<double>(now[k].mean.at(row, col, c));
          // The photograph before had as much noise.
          noise += 2 * static_cast<double>(now[k].variance.at(row, col, c)) * slope * slope.transpose();
        }
    }
  const Error unseen{ErrorCode::bad_value, "the stripes cannot be seen, so motion cannot be measured",
                     "check lamp and shutter, then calibrate the rig again"};
  const Eigen::MatrixXd inverse = calibration::inverse_if_regular(normal);
  if (inverse.size() == 0) return unseen;
  const Eigen::Vector3d found = inverse * right;
  if (!(found[0] > kDark) || !found.allFinite()) return unseen;
  const Eigen::Matrix3d covariance = inverse * noise * inverse;
  const double down = found[1] / found[0], across = found[2] / found[0];
  Motion motion;
  motion.brightness = found[0];
  motion.row = down * step_[0].row + across * step_[1].row;
  motion.col = down * step_[0].col + across * step_[1].col;
  const double pixels = std::sqrt(std::max(covariance(1, 1), covariance(2, 2))) / std::abs(found[0]);
  motion.sigma =
      pixels * std::max(std::hypot(step_[0].row, step_[1].row), std::hypot(step_[0].col, step_[1].col));
  return motion;
}

}  // namespace symrig
