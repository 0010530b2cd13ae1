// SPDX-License-Identifier: Apache-2.0
#include "calibration/footprint_shape.hpp"

#include <algorithm>
#include <cmath>

namespace symrig::calibration {

void ShapeFit::add(const StripeLight& light, std::optional<int> left_out, double position,
                   const Differences& seen, float contrast) {
  const double weight =
      static_cast<double>(contrast) * static_cast<double>(contrast) / static_cast<double>(seen.variance);
  for (int bit = 0; bit < light.bits(); ++bit) {
    if (bit == left_out) continue;
    const Shape m = light.contrasts(position, bit);
    const double d = static_cast<double>(seen.value[bit]) / static_cast<double>(contrast);
    for (std::size_t i = 0; i < kSize; ++i) {
      const double weighted = weight * static_cast<double>(m[i]);
      for (std::size_t j = 0; j < kSize; ++j) a_[i][j] += weighted * static_cast<double>(m[j]);
      b_[i] += weighted * d;
    }
  }
  pixels_ += 1;
}

ShapeFit& ShapeFit::operator+=(const ShapeFit& other) {
  for (std::size_t i = 0; i < kSize; ++i) {
    for (std::size_t j = 0; j < kSize; ++j) a_[i][j] += other.a_[i][j];
    b_[i] += other.b_[i];
  }
  pixels_ += other.pixels_;
  return *this;
}

double ShapeFit::information() const {
  double trace = 0;
  for (std::size_t i = 0; i < kSize; ++i) trace += a_[i][i];
  return pixels_ > 0 ? trace / static_cast<double>(kSize) / pixels_ : 0;
}

/// Cyclic coordinate descent on the non-negative quadratic programme. `left`: b − A x. It stops after a fixed
/// number of sweeps: shares that the bits hardly distinguish then stay near the prior, which is acceptable.
Shape ShapeFit::solve(const Shape& usual, double pull) const {
  if (pixels_ == 0) return usual;
  Matrix a = a_;
  Vector x{}, left = b_, per_diagonal{};
  for (std::size_t i = 0; i < kSize; ++i) {
    a[i][i] += pull;
    per_diagonal[i] = 1 / a[i][i];
    x[i] = static_cast<double>(usual[i]);
    left[i] += pull * x[i];
  }
  for (std::size_t i = 0; i < kSize; ++i)
    for (std::size_t j = 0; j < kSize; ++j) left[j] -= x[i] * a[i][j];
  constexpr int kSweeps = 50;
  constexpr double kSettled = 1e-10;  // far below the precision of a float
  double change = 1;
  for (int sweep = 0; sweep < kSweeps && change > kSettled; ++sweep) {
    change = 0;
    for (std::size_t i = 0; i < kSize; ++i) {
      const double step = std::max(-x[i], left[i] * per_diagonal[i]);
      if (step == 0) continue;
      x[i] += step;
      for (std::size_t j = 0; j < kSize; ++j) left[j] -= step * a[i][j];
      change = std::max(change, std::abs(step));
    }
  }
  Shape shape{};
  std::ranges::transform(x, shape.begin(), [](double share) { return static_cast<float>(share); });
  return shape;
}

}  // namespace symrig::calibration
