// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Dense>

namespace symrig::calibration {

/// What one camera pixel sees: y(p) = black + direct · d(p) + near · n(p) + far · f(p), with direct, near,
/// far ≥ 0.
struct PixelLight {
  double black = 0, direct = 0, near = 0, far = 0;
  double squared_residual = 0;  ///< sum over the photographs
};

/// Light of one pattern on one camera pixel, 0..1 each.
struct PatternLight {
  double direct = 0;  ///< on its footprint
  double near = 0;    ///< on the surroundings of the footprint
  double far = 0;     ///< mean over the projector
};

/// Linear least squares of PixelLight, gathered photograph by photograph.
class PixelLightFit {
 public:
  /// y: what the camera saw.
  void add(const PatternLight& p, double y) {
    const Eigen::Vector4d x(1, p.direct, p.near, p.far);
    a_.noalias() += x * x.transpose();
    b_ += y * x;
    yy_ += y * y;
  }

  /// Least squares under direct, near, far ≥ 0. Direct light below `least` of its standard errors at unit
  /// noise is taken for none. With `lit` false neither direct nor near light is looked for.
  PixelLight solve(bool lit, double least) const;

 private:
  Eigen::Matrix4d active_matrix(unsigned active) const;
  PixelLight solve_for(unsigned active) const;
  PixelLight solve_signed(unsigned allowed) const;

  Eigen::Matrix4d a_ = Eigen::Matrix4d::Zero();
  Eigen::Vector4d b_ = Eigen::Vector4d::Zero();
  double yy_ = 0;
};

}  // namespace symrig::calibration
