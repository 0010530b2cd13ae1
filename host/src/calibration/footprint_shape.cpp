// SPDX-License-Identifier: Apache-2.0
#include "calibration/footprint_shape.hpp"

#include <algorithm>

namespace symrig::calibration {

void ShapeFit::add(const StripeLight& light, std::optional<int> left_out, double position,
                   const Differences& seen, float contrast) {
  const double weight =
      static_cast<double>(contrast) * static_cast<double>(contrast) / static_cast<double>(seen.variance);
  for (int bit = 0; bit < light.bits(); ++bit) {
    if (bit == left_out) continue;
    const Shape m = light.contrasts(position, bit);
    const double d =
        static_cast<double>(seen.value[static_cast<std::size_t>(bit)]) / static_cast<double>(contrast);
    const Vector row = Eigen::Map<const Eigen::Matrix<float, kSize, 1>>(m.data()).cast<double>();
    a_.noalias() += weight * row * row.transpose();
    b_ += weight * d * row;
  }
  pixels_ += 1;
}

ShapeFit& ShapeFit::operator+=(const ShapeFit& other) {
  a_ += other.a_;
  b_ += other.b_;
  pixels_ += other.pixels_;
  return *this;
}

/// Cyclic coordinate descent on the non-negative quadratic programme.
Shape ShapeFit::solve(const Shape& usual, double pull) const {
  if (pixels_ == 0) return usual;
  const Vector prior = Eigen::Map<const Eigen::Matrix<float, kSize, 1>>(usual.data()).cast<double>();
  const Matrix a = a_ + pull * Matrix::Identity();
  const Vector b = b_ + pull * prior;
  Vector x = prior;
  constexpr int kSweeps = 50;
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    for (int i = 0; i < kSize; ++i) x[i] = std::max(0.0, x[i] + (b[i] - a.row(i).dot(x)) / a(i, i));
  Shape shape{};
  Eigen::Map<Eigen::Matrix<float, kSize, 1>>(shape.data()) = x.cast<float>();
  return shape;
}

}  // namespace symrig::calibration
