// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/non_negative.hpp"

#include <array>
#include <cstddef>

namespace symrig::calibration {

/// The number of sizes of surroundings that near light may come from.
inline constexpr std::size_t kNearSizes = 3;

/// The light model of one camera pixel: y(p) = black + direct · d(p) + Σ_z near_z · n_z(p) + far · f(p), with
/// direct, near, far ≥ 0.
struct PixelLight {
  double black = 0, direct = 0;
  std::array<double, kNearSizes> near{};
  double far = 0;
  double squared_residual = 0;  ///< sum over the photographs
};

/// Light of one pattern on one camera pixel, 0..1 each.
struct PatternLight {
  double direct = 0;                      ///< on its footprint
  std::array<double, kNearSizes> near{};  ///< on the surroundings of the footprint, by size
  double far = 0;                         ///< mean over the projector
};

/// Linear least squares of PixelLight, summed photograph by photograph.
class PixelLightFit {
 public:
  /// y: the value of the camera pixel.
  void add(const PatternLight& p, double y) {
    const Solver::Vector x{1, p.direct, p.near[0], p.near[1], p.near[2], p.far};
    for (std::size_t i = 0; i < kUnknowns; ++i) {
      for (std::size_t j = 0; j < kUnknowns; ++j) a_[i][j] += x[i] * x[j];
      b_[i] += y * x[i];
    }
    yy_ += y * y;
  }

  /// Least squares with direct, near, far ≥ 0. Direct light below `least` of its standard errors at unit
  /// noise is set to 0. So is near light of a size that lowers the squared residual by less than
  /// `least_near`². If `lit` is false, direct and near light are 0.
  PixelLight solve(bool lit, double least, double least_near) const;

 private:
  static constexpr std::size_t kUnknowns = 3 + kNearSizes;
  using Solver = NonNegative<kUnknowns>;
  using Point = Solver::Point;

  double ridge() const;
  double squared_residual(const Solver::Vector& x) const;
  Point without_noise(const Solver& solver, double least, Solver::Set& allowed) const;
  PixelLight light_of(const Point& point) const;

  Solver::Matrix a_{};
  Solver::Vector b_{};
  double yy_ = 0;
};

}  // namespace symrig::calibration
