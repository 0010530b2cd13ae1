// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace symrig::sim {

/// A bijection of 64 bits in which every input bit affects every output bit: two rounds of xor-shift and odd
/// multiplication, the finaliser of the splitmix family [Steele14]. Uses only integers, so results are equal
/// on all computers.
constexpr std::uint64_t mix(std::uint64_t x) {
  x ^= x >> 30U;
  x *= 0xbf58476d1ce4e5b9ULL;
  x ^= x >> 27U;
  x *= 0x94d049bb133111ebULL;
  x ^= x >> 31U;
  return x;
}

/// Makes one key from two, for counters such as (seed, row, column).
constexpr std::uint64_t combine(std::uint64_t key, std::uint64_t counter) {
  return mix(key + 0x9e3779b97f4a7c15ULL * (counter + 1));
}

/// The upper 24 bits as a float in [0, 1). Exact on all computers.
constexpr float unit_float(std::uint64_t bits) {
  return static_cast<float>(bits >> 40U) * 0x1p-24F;
}

/// The upper 53 bits as a double in [0, 1).
constexpr double unit_double(std::uint64_t bits) {
  return static_cast<double>(bits >> 11U) * 0x1p-53;
}

/// z with P(Z ≤ z) = u for a standard normal Z, 0 < u < 1: rational approximations in three ranges.
/// error: relative, ≤ 2e-7.  source: algorithm AS 241, routine PPND7 [Wichura88].
double normal_quantile(double u);

/// Below this mean the exact distribution is used.
inline constexpr double kExactPoissonMean = 50;

/// The smallest n with P(N ≤ n) ≥ u for a Poisson N of this mean; 0 ≤ u < 1.
/// Below kExactPoissonMean: the exact distribution, summed term by term in double. Above: the second-order
/// Cornish-Fisher expansion, σz + (z² − 1)/6 + (z − z³)/(72σ) about the mean, rounded. Its distribution
/// function is within 5e-4 of the exact one everywhere, its mean within 0.005 and its variance within 0.1 %.
/// source: [Johnson05 §4.3, §1.5.3].
std::int64_t poisson_quantile(double mean, double u);

}  // namespace symrig::sim
