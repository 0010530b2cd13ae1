// SPDX-License-Identifier: Apache-2.0
#include "tensor/half.hpp"

#include <algorithm>
#include <cmath>

namespace symrig::tensor {

int to_halves(std::span<const float> values, int top, Half* out) {
  float largest = 0;
  for (const float v : values)
    if (std::isfinite(v)) largest = std::max(largest, std::abs(v));
  int exponent = largest > 0 ? std::ilogb(largest) - top : 0;
  // Rounding may move the largest value up to a power of two. Use the exponent of that power, so that a
  // second rounding gives the same bits.
  const double rounded = from_half(to_half(static_cast<float>(std::ldexp(double{largest}, -exponent))));
  if (rounded >= std::ldexp(1.0, top + 1)) ++exponent;
  const double scale = std::ldexp(1.0, -exponent);
  std::transform(values.begin(), values.end(), out,
                 [scale](float v) { return to_half(static_cast<float>(double{v} * scale)); });
  return exponent;
}

float power_of_two(int exponent) {
  return exponent < -126 ? 0.0F : std::ldexp(1.0F, std::min(exponent, 127));
}

}  // namespace symrig::tensor
