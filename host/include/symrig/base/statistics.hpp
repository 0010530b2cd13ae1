// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <ranges>
#include <span>

namespace symrig {

/// Numbers whose order may change: a vector, a span or an array of them.
template <class Values>
concept Reorderable = std::ranges::random_access_range<Values> && std::ranges::sized_range<Values> &&
    std::permutable<std::ranges::iterator_t<Values>>;

/// The value at `rank` in ascending order, where 0 is the smallest. Reorders the values.
/// 0 <= rank < size. Takes time in proportion to the size, as the functions below do. None may be NaN.
template <Reorderable Values>
std::ranges::range_value_t<Values> ranked(Values&& values, std::ptrdiff_t rank) {
  const auto at = std::ranges::begin(values) + rank;
  std::ranges::nth_element(values, at);
  return *at;
}

/// The value that a share (0 to 1) of the others does not exceed: rank floor(share × (size − 1)), without
/// interpolation. A share of 0.5 of an even number of values gives the lower of the two in the middle.
/// Reorders the values. 0 if there are none.
template <Reorderable Values>
std::ranges::range_value_t<Values> quantile(Values&& values, double share) {
  const auto size = std::ranges::ssize(values);
  if (size == 0) return {};
  return ranked(values, static_cast<std::ptrdiff_t>(share * static_cast<double>(size - 1)));
}

/// The value in the middle: rank size / 2. An even number of values gives the upper of the two in the middle.
/// Reorders the values. 0 if there are none.
template <Reorderable Values>
std::ranges::range_value_t<Values> median(Values&& values) {
  const auto size = std::ranges::ssize(values);
  return size == 0 ? std::ranges::range_value_t<Values>{} : ranked(values, size / 2);
}

/// σ of a normal distribution about a known centre, robust against a minority of outliers:
/// 1.4826 × median |x − centre|. 0 if there are no values. Works on a copy.
double robust_sigma(std::span<const double> values, double centre);
/// The same about the median of the values.
double robust_sigma(std::span<const double> values);

/// A residual of this many robust sigmas, or more, does not count. Normal residuals then tell as much as 95 %
/// of them would by least squares [Beaton74].
inline constexpr double kTukeyReach = 4.685;

/// How much a residual counts in a robust fit: Tukey's biweight, (1 − u²)² for u = sigmas / kTukeyReach.
/// sigmas: the residual in robust sigmas, of either sign. Result: 0 to 1.
constexpr double tukey_weight(double sigmas) {
  const double u = sigmas / kTukeyReach, rest = 1 - u * u;
  return rest > 0 ? rest * rest : 0;
}

/// A small random generator, SplitMix64 (Steele, Lea, Flood, OOPSLA 2014). It gives the same numbers on every
/// machine.
class Random {
 public:
  explicit constexpr Random(std::uint64_t seed) : state_(seed) {}

  constexpr std::uint64_t bits() {
    std::uint64_t z = (state_ += 0x9E3779B97F4A7C15U);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
    return z ^ (z >> 31);
  }
  /// Uniform in [0, 1), 53 bits.
  constexpr double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  /// −1 or +1.
  constexpr float sign() { return (bits() >> 63) != 0 ? 1.0F : -1.0F; }

 private:
  std::uint64_t state_;
};

}  // namespace symrig
