// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>

namespace symrig::acquisition {

/// Rounds numbers to multiples of one power of two q. As long as a sum of them stays below 2⁵³ q, doubles
/// hold it exactly, so it has the same bits in any order. [Demmel13]
/// error: ≤ q / 2 = 2⁻⁵⁰ most a number.
class ExactSums {
 public:
  /// most: bounds each number, and the sum of the magnitudes of those that are added up. Both may be twice
  /// that: whoever computes numbers in floats exceeds his bound by their rounding.
  explicit ExactSums(double most) {
    int exponent = 0;  // most < 2^exponent
    static_cast<void>(std::frexp(most, &exponent));
    // Numbers up to 2^(exponent + 1) = 2⁵¹ q leave shift + number between 2⁵² q and 2⁵³ q, where doubles are
    // multiples of q.
    shift_ = most > 0 ? std::ldexp(1.5, exponent - 50 + 52) : 0;
  }
  double rounded(float number) const { return (static_cast<double>(number) + shift_) - shift_; }

 private:
  double shift_;
};

}  // namespace symrig::acquisition
