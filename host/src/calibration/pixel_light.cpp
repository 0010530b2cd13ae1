// SPDX-License-Identifier: Apache-2.0
#include "calibration/pixel_light.hpp"

#include <algorithm>
#include <cmath>

namespace symrig::calibration {
namespace {

// Sets of unknowns: bit i stands for unknown i of (black, direct, near..., far).
constexpr unsigned kBlack = 1, kDirect = 2, kFar = 1U << (2 + kNearSizes);

}  // namespace

/// If no photograph distinguishes two kinds of light, the matrix is singular. This share of its trace keeps
/// it solvable.
double PixelLightFit::ridge() const {
  constexpr double kRidge = 1e-6;
  double trace = 0;
  for (std::size_t i = 0; i < kUnknowns; ++i) trace += a_[i][i];
  return kRidge * trace;
}

/// Σ y² − 2 b x + x A x
double PixelLightFit::squared_residual(const Solver::Vector& x) const {
  double sum = yy_;
  for (std::size_t i = 0; i < kUnknowns; ++i) {
    double row = -2 * b_[i];
    for (std::size_t j = 0; j < kUnknowns; ++j) row += a_[i][j] * x[j];
    sum += x[i] * row;
  }
  return std::max(sum, 0.0);
}

/// Near light of the sizes that are not negligible. Near light cannot be negative, so noise alone would take
/// some of the direct light in every pixel. So the weakest size is removed, one after another, as long as the
/// residual rises by less than `least`² without it.
PixelLightFit::Point PixelLightFit::without_noise(const Solver& solver, double least,
                                                  Solver::Set& allowed) const {
  Point light = solver.minimum(allowed, {.active = kBlack});
  while (true) {
    std::size_t weakest = 0;
    double size = 0;
    for (std::size_t z = 2; z < 2 + kNearSizes; ++z) {
      const double light_of = light.x[z] * std::sqrt(a_[z][z]);
      if (light_of > 0 && (weakest == 0 || light_of < size)) weakest = z, size = light_of;
    }
    if (weakest == 0) return light;
    const Solver::Set fewer = allowed & ~(1U << weakest);
    const Point other = solver.minimum(fewer, light);
    if (squared_residual(other.x) - squared_residual(light.x) > least * least) return light;
    light = other;
    allowed = fewer;
  }
}

PixelLight PixelLightFit::light_of(const Point& point) const {
  PixelLight light;
  light.black = point.x[0];
  light.direct = point.x[1];
  std::copy_n(point.x.begin() + 2, kNearSizes, light.near.begin());
  light.far = point.x[kUnknowns - 1];
  light.squared_residual = squared_residual(point.x);
  return light;
}

PixelLight PixelLightFit::solve(bool lit, double least, double least_near) const {
  const Solver solver(a_, b_, ridge(), kBlack);
  Solver::Set allowed = lit ? Solver::kAll : kBlack | kFar;
  const Point light = without_noise(solver, least_near, allowed);
  const double direct = light.x[1];
  if (direct <= 0) return light_of(light);
  const double deviation = std::sqrt(solver.solved(Solver::kAll, {0, 1})[1]);
  if (direct > least * deviation) return light_of(light);
  return light_of(solver.minimum(Solver::kAll & ~kDirect, {.active = kBlack}));
}

}  // namespace symrig::calibration
