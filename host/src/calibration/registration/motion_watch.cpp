// SPDX-License-Identifier: Apache-2.0
#include "calibration/fitting/least_squares.hpp"
#include "symrig/calibration/registration.hpp"
#include "symrig/hdr/bracket_plan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

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

/// add(photograph, channel, row, column, slope) for each pixel that has neighbours, with slope = (before,
/// ∂ before / ∂ row, ∂ before / ∂ column).
template <class Add>
void MotionWatch::for_each_slope(Add add) const {
  const Grid camera = before_.grid();
  const int channels = before_.channels() / 2;
  // The slope between pixels of two colours is that of the filters, not of the picture.
  const int apart = mosaic_ == Mosaic::none ? 1 : 2;
  for (int plane = 0; plane < before_.channels(); ++plane) {
    const auto was = [&](int row, int col) { return static_cast<double>(before_.at(row, col, plane)); };
    for (int row = apart; row + apart < camera.rows; ++row)
      for (int col = apart; col + apart < camera.cols; ++col)
        add(plane / channels, plane % channels, row, col,
            Eigen::Vector3d(was(row, col), (was(row + apart, col) - was(row - apart, col)) / (2 * apart),
                            (was(row, col + apart) - was(row, col - apart)) / (2 * apart)));
  }
}

/// Of a motion in camera pixels, at most.
double MotionWatch::cells_of(double pixels) const {
  return pixels * std::max(std::hypot(step_[0].row, step_[1].row), std::hypot(step_[0].col, step_[1].col));
}

/// As noisy as compare() allows for kSigma, and never noisier than a tenth of the light. A rig that is told
/// nothing exposes until dark stripes are known too, which takes many times longer. Nothing: no edges.
std::vector<Expectation> MotionWatch::expected() const {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  for_each_slope(
      [&](int, int, int, int, const Eigen::Vector3d& slope) { normal += slope * slope.transpose(); });
  const Eigen::MatrixXd inverse = calibration::inverse_if_regular(normal);
  if (inverse.size() == 0) return {};
  // With the same variance in every pixel, the covariance of compare() is 2 · variance · inverse.
  const double noise = std::pow(kSigma / cells_of(1), 2) / (2 * std::max(inverse(1, 1), inverse(2, 2)));
  constexpr double kMostRelative = 0.1;
  std::vector<Expectation> expected(2);
  for (std::size_t k = 0; k < expected.size(); ++k) {
    LightHistogram light;
    const std::size_t half = before_.values().size() / 2;
    for (const float v : before_.values().subspan(k * half, half)) light.add(std::max(v, 0.F));
    const double most = kMostRelative * kMostRelative * light.mean_square();
    expected[k].parts = {{light.lights(), std::min(noise, most)}};
  }
  return expected;
}

namespace {

/// Where a lamp or an iris gives more light than at the registration, the lit pixels are too bright.
bool too_bright(std::span<const Radiance> photographs, const Image<float>& before) {
  std::size_t lost = 0, lit = 0;
  const float half = std::ranges::max(before.values()) / 2;
  std::size_t at = 0;
  for (const Radiance& one : photographs)
    for (const std::uint8_t valid : one.valid.values()) {
      if (before.values()[at++] < half) continue;
      ++lit;
      lost += valid == 0 ? 1 : 0;
    }
  return 10 * lost > lit;
}

}  // namespace

Result<Motion> MotionWatch::measure(Probe& rig) const {
  const std::array<Pattern, 2> stripes = patterns(cells_);
  const std::vector<Expectation> wanted = expected();
  if (wanted.empty()) {
    SYMRIG_TRY(const auto now, rig.measure(stripes));
    return compare(now);
  }
  SYMRIG_TRY(auto now, rig.measure_expected(stripes, wanted));
  SYMRIG_CHECK(check(now));
  if (too_bright(now, before_)) {
    SYMRIG_TRY(now, rig.measure(stripes));
  }
  return compare(now);
}

/// Whether photographs are of this camera.
Result<void> MotionWatch::check(std::span<const Radiance> now) const {
  if (now.size() != 2)
    return Error{ErrorCode::size_mismatch, "motion is measured by two photographs of stripes",
                 "take one of each of MotionWatch::patterns()"};
  for (const Radiance& one : now)
    if (one.mean.grid() != before_.grid() || one.mean.channels() != before_.channels() / 2)
      return Error{ErrorCode::size_mismatch, "the photographs of the stripes do not fit the registration",
                   "calibrate the rig again"};
  return {};
}

/// Least squares for brightness and the two components of the motion, in pixels: now = brightness · before +
/// down · ∂ before / ∂ row + right · ∂ before / ∂ column.
Result<Motion> MotionWatch::compare(std::span<const Radiance> now) const {
  SYMRIG_CHECK(check(now));
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d noise = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for_each_slope([&](int k, int c, int row, int col, const Eigen::Vector3d& slope) {
    if (!now[k].valid.at(row, col, c)) return;
    // Every pixel counts the same: dark ones have less noise, but no edges.
    normal += slope * slope.transpose();
    right += slope * static_cast<double>(now[k].mean.at(row, col, c));
    // The photograph before had as much noise.
    noise += 2 * static_cast<double>(now[k].variance.at(row, col, c)) * slope * slope.transpose();
  });
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
  motion.sigma = cells_of(std::sqrt(std::max(covariance(1, 1), covariance(2, 2))) / std::abs(found[0]));
  return motion;
}

}  // namespace symrig
