// SPDX-License-Identifier: Apache-2.0
// IEEE 754 binary16 as a storage format, on machines with and without instructions for it.
#pragma once

#include <bit>
#include <cstdint>
#include <span>

namespace symrig::tensor {

/// The bits of a binary16: 1 sign, 5 exponent (bias 15), 10 fraction.
using Half = std::uint16_t;

/// Nearest half, ties to even. error: ≤ 2⁻¹¹ |value| for 2⁻¹⁴ ≤ |value| < 65520, ≤ 2⁻²⁵ below; ±∞ above.
inline Half to_half(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  const std::uint32_t sign = (bits >> 16U) & 0x8000U;
  const std::uint32_t size = bits & 0x7FFF'FFFFU;
  if (size > 0x7F80'0000U) return static_cast<Half>(sign | 0x7E00U);   // NaN
  if (size >= 0x477F'F000U) return static_cast<Half>(sign | 0x7C00U);  // 65520 and more
  if (size < 0x3880'0000U) {                                  // below 2⁻¹⁴: a multiple of 2⁻²⁴
    const float shifted = std::bit_cast<float>(size) + 0.5F;  // whose last bit is worth 2⁻²⁴
    return static_cast<Half>(sign | (std::bit_cast<std::uint32_t>(shifted) - 0x3F00'0000U));
  }
  const std::uint32_t rounded = size + 0xFFFU + ((size >> 13U) & 1U);
  return static_cast<Half>(sign | ((rounded - 0x3800'0000U) >> 13U));
}

/// Exact.
inline float from_half(Half half) {
  const std::uint32_t sign = (half & 0x8000U) << 16U;
  const std::uint32_t size = half & 0x7FFFU;
  if (size >= 0x7C00U) return std::bit_cast<float>(sign | 0x7F80'0000U | ((size & 0x3FFU) << 13U));
  if (size < 0x400U) return (sign != 0 ? -0x1p-24F : 0x1p-24F) * static_cast<float>(size);
  return std::bit_cast<float>(sign | ((size << 13U) + 0x3800'0000U));
}

/// values ≈ out · 2^exponent, with the largest |out| in [2^top, 2^(top+1)). Returns the exponent. Values that
/// were converted from such halves give the same bits again. error: ≤ 2⁻¹¹ |value| + 2^(−25 − top)
/// max|value|. NaN and infinity are kept.
int to_halves(std::span<const float> values, int top, Half* out);

/// The same for halves, in place: halves before ≈ halves after · 2^exponent. They must be finite.
int to_top(std::span<Half> values, int top);

/// The largest magnitude, as the bits of a half without a sign. 0x7C00 and more: infinity or NaN.
Half largest_half(std::span<const Half> values);

/// 2^exponent as a float: 0 if it is too small, the largest power of two if it is too large.
float power_of_two(int exponent);

}  // namespace symrig::tensor
