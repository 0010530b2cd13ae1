// SPDX-License-Identifier: Apache-2.0
#include "symrig/tensor/internal/half.hpp"

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

Half largest_half(std::span<const Half> values) {
  Half largest = 0;
  for (const Half v : values) largest = std::max(largest, static_cast<Half>(v & 0x7FFFU));
  return largest;
}

namespace {

/// values · 2^shift, shift > 0, exactly: no value may leave the range. Adding to the exponent moves all but
/// those below 2⁻¹⁴, which have none.
void scale_up(std::span<Half> values, int shift) {
  const auto more = static_cast<std::uint32_t>(shift) << 10U;
  std::uint32_t tiny = 0;
  for (Half& v : values) {
    const bool normal = (v & 0x7C00U) != 0;
    tiny |= normal ? 0U : v & 0x3FFU;
    v = static_cast<Half>(normal ? v + more : v);
  }
  if (tiny == 0) return;
  // A scaled value is 2⁻¹⁴ 2^shift or larger, or was one of the tiny ones.
  const float scale = std::ldexp(1.0F, shift);
  for (Half& v : values)
    if (const std::uint32_t size = v & 0x7FFFU; size < 0x400U) v = to_half(from_half(v) * scale);
}

}  // namespace

int to_top(std::span<Half> values, int top) {
  const Half largest = largest_half(values);
  if (largest == 0) return 0;
  const int exponent = std::ilogb(from_half(largest)) - top;
  if (exponent < 0) scale_up(values, -exponent);
  if (exponent > 0)
    for (Half& v : values) v = to_half(std::ldexp(from_half(v), -exponent));
  return exponent;
}

float power_of_two(int exponent) {
  return exponent < -126 ? 0.0F : std::ldexp(1.0F, std::min(exponent, 127));
}

}  // namespace symrig::tensor
