// SPDX-License-Identifier: Apache-2.0
#include "calibration/pixel_light.hpp"

#include <algorithm>
#include <cmath>

namespace symrig::calibration {
namespace {

// Sets of unknowns: bit i stands for unknown i of (black, direct, near..., far).
constexpr unsigned kBlack = 1, kDirect = 2, kFar = 1U << (2 + kNearSizes);
constexpr unsigned kAll = 2 * kFar - 1;

}  // namespace

/// Without photographs that tell two kinds of light apart the matrix is singular; this much of its trace
/// keeps it solvable.
PixelLightFit::Matrix PixelLightFit::regular() const {
  constexpr double kRidge = 1e-6;
  return a_ + kRidge * a_.trace() * Matrix::Identity();
}

/// Active sets [Lawson74 ch. 23], unknowns that are not `allowed` stay 0, black has no sign: unknowns whose
/// value would turn negative leave the set one by one, the one that the residual asks for most comes in.
PixelLight PixelLightFit::solve_for(unsigned allowed) const {
  const Matrix a = regular();
  unsigned active = kBlack;
  Vector x = Vector::Zero();
  const auto solved = [&](unsigned set) {
    Matrix part = Matrix::Identity();
    Vector right = Vector::Zero();
    for (int i = 0; i < kUnknowns; ++i) {
      if (!(set >> i & 1U)) continue;
      right[i] = b_[i];
      for (int j = 0; j < kUnknowns; ++j)
        if (set >> j & 1U) part(i, j) = a(i, j);
    }
    return Vector(part.ldlt().solve(right));
  };
  x = solved(active);
  constexpr int kMost = 3 * kUnknowns;
  for (int round = 0; round < kMost; ++round) {
    const Vector asks = b_ - a * x;
    int next = -1;
    for (int i = 1; i < kUnknowns; ++i)
      if ((allowed & ~active) >> i & 1U)
        if (asks[i] > 1e-9 * std::abs(b_[i]) && (next < 0 || asks[i] > asks[next])) next = i;
    if (next < 0) break;
    active |= 1U << next;
    Vector wanted = solved(active);
    while (true) {
      double step = 1;
      int blocks = -1;
      for (int i = 1; i < kUnknowns; ++i)
        if ((active >> i & 1U) && wanted[i] < 0 && x[i] - wanted[i] > 0)
          if (const double s = x[i] / (x[i] - wanted[i]); s < step || blocks < 0) step = s, blocks = i;
      if (blocks < 0) break;
      x += step * (wanted - x);
      x[blocks] = 0;
      active &= ~(1U << blocks);
      wanted = solved(active);
    }
    x = wanted;
  }
  const double residual = yy_ - 2 * b_.dot(x) + x.dot(a_ * x);
  PixelLight light;
  light.black = x[0];
  light.direct = x[1];
  for (std::size_t z = 0; z < kNearSizes; ++z) light.near[z] = x[2 + static_cast<int>(z)];
  light.far = x[kUnknowns - 1];
  light.squared_residual = std::max(residual, 0.0);
  return light;
}

/// Near light of the sizes that are not negligible. As near light cannot be negative, noise alone would take
/// some from the direct light in every pixel: the weakest size goes, one after another, as long as the
/// residual rises by less than `least`² without it.
PixelLight PixelLightFit::without_noise(double least, unsigned& allowed) const {
  PixelLight light = solve_for(allowed);
  while (true) {
    int weakest = -1;
    double size = 0;
    for (int z = 0; z < static_cast<int>(kNearSizes); ++z) {
      const double light_of = light.near[static_cast<std::size_t>(z)] * std::sqrt(a_(2 + z, 2 + z));
      if (light_of > 0 && (weakest < 0 || light_of < size)) weakest = z, size = light_of;
    }
    if (weakest < 0) return light;
    const unsigned fewer = allowed & ~(1U << (2 + weakest));
    const PixelLight other = solve_for(fewer);
    if (other.squared_residual - light.squared_residual > least * least) return light;
    light = other;
    allowed = fewer;
  }
}

PixelLight PixelLightFit::solve(bool lit, double least, double least_near) const {
  unsigned allowed = lit ? kAll : kBlack | kFar;
  const PixelLight light = without_noise(least_near, allowed);
  if (light.direct <= 0) return light;
  const double deviation = std::sqrt(regular().inverse()(1, 1));
  return light.direct > least * deviation ? light : solve_for(kAll & ~kDirect);
}

}  // namespace symrig::calibration
