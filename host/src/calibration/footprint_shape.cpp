// SPDX-License-Identifier: Apache-2.0
#include "calibration/footprint_shape.hpp"

#include "calibration/non_negative.hpp"

#include <algorithm>
#include <cmath>

namespace symrig::calibration {

void ShapeFit::add(const StripeLight& light, std::optional<int> left_out, double position,
                   const Differences& seen, float contrast) {
  // One pixel has few terms, so floats keep enough digits.
  std::array<ScaleLanes, kMaxBits> m;
  light.contrasts(position, m.data());
  Bits d;
  int terms = 0;
  for (int bit = 0; bit < light.bits(); ++bit) {
    if (bit == left_out) continue;
    m[terms] = m[bit];
    d[terms++] = seen.value[bit] / contrast;
  }
  ShapeSums sums;
  sum_shape(m.data(), d.data(), terms, contrast * contrast / seen.variance, sums);
  for (std::size_t i = 0; i < kSize; ++i) {
    for (std::size_t j = 0; j < kSize; ++j) a_[i][j] += static_cast<double>(sums.a[i][j]);
    b_[i] += static_cast<double>(sums.b[i]);
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

Shape ShapeFit::solve(const Shape& usual, double pull) const {
  if (pixels_ == 0) return usual;
  // The prior adds pull · (x − usual)². The usual shape is also a near starting point.
  Vector b = b_;
  NonNegative<kSize>::Point from;
  for (std::size_t i = 0; i < kSize; ++i) {
    from.x[i] = static_cast<double>(usual[i]);
    if (usual[i] > 0) from.active |= 1U << i;
    b[i] += pull * from.x[i];
  }
  const NonNegative<kSize> solver(a_, b, pull);
  const Vector x = solver.minimum(NonNegative<kSize>::kAll, from).x;
  Shape shape{};
  std::ranges::transform(x, shape.begin(), [](double share) { return static_cast<float>(share); });
  return shape;
}

}  // namespace symrig::calibration
