// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace symrig::sim {

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
