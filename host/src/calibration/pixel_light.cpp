// SPDX-License-Identifier: Apache-2.0
#include "calibration/pixel_light.hpp"

#include <algorithm>
#include <cmath>

namespace symrig::calibration {
namespace {

// Sets of unknowns: bit i stands for unknown i of (black, direct, near, far).
constexpr unsigned kBlack = 1, kDirect = 2, kNear = 4, kFar = 8;

bool feasible(const PixelLight& light) {
  return light.direct >= 0 && light.near >= 0 && light.far >= 0;
}

}  // namespace

/// Unknowns that are off keep a unit diagonal (and a zero right side), and so come out as 0.
Eigen::Matrix4d PixelLightFit::active_matrix(unsigned active) const {
  // Without photographs that tell two kinds of light apart the matrix is singular; this much of its trace
  // keeps it solvable.
  constexpr double kRidge = 1e-6;
  Eigen::Matrix4d a = Eigen::Matrix4d::Identity();
  for (int i = 0; i < 4; ++i) {
    if (!(active >> i & 1U)) continue;
    for (int j = 0; j < 4; ++j)
      if (active >> j & 1U) a(i, j) = a_(i, j) + (i == j ? kRidge * a_.trace() : 0);
  }
  return a;
}

PixelLight PixelLightFit::solve_for(unsigned active) const {
  Eigen::Vector4d b = b_;
  for (int i = 0; i < 4; ++i)
    if (!(active >> i & 1U)) b[i] = 0;
  const Eigen::Vector4d x = active_matrix(active).ldlt().solve(b);
  const double residual = yy_ - 2 * b.dot(x) + x.dot(a_ * x);
  return {x[0], x[1], x[2], x[3], std::max(residual, 0.0)};
}

/// Three unknowns with a sign: if all together are not feasible, every subset is tried and the best feasible
/// one wins.
PixelLight PixelLightFit::solve_signed(unsigned allowed) const {
  const PixelLight all = solve_for(allowed);
  if (feasible(all)) return all;
  PixelLight best = solve_for(kBlack);
  for (unsigned active = kBlack; active <= (kBlack | kDirect | kNear | kFar); active += 2) {
    if ((active & allowed) != active) continue;
    const PixelLight one = solve_for(active);
    if (feasible(one) && one.squared_residual < best.squared_residual) best = one;
  }
  return best;
}

PixelLight PixelLightFit::solve(bool lit, double least) const {
  constexpr unsigned kAll = kBlack | kDirect | kNear | kFar;
  const PixelLight light = solve_signed(lit ? kAll : kBlack | kFar);
  if (light.direct <= 0) return light;
  const double deviation = std::sqrt(active_matrix(kAll).inverse()(1, 1));
  return light.direct > least * deviation ? light : solve_signed(kAll & ~kDirect);
}

}  // namespace symrig::calibration
