// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace symrig::sim {

/// 1/u² ≈ Σ_q weight_q exp(−rate_q u), every weight and rate positive, rates ascending.
struct GaussianSum {
  std::vector<double> weight, rate;
};

/// A term whose exponent rate · u exceeds this adds less than 3e-8 of 1/u² and may be dropped.
inline constexpr double kNegligibleExponent = 24;
/// Relative error of the sum over its whole range.
inline constexpr double kGaussianSumError = 3e-6;

/// The terms for lowest ≤ u ≤ highest (0 < lowest): the trapezoidal rule with step h on
/// 1/u² = ∫ τ² exp(−τu) d ln τ.  Its relative error is 2|Γ(2 + 2πi/h)|: 1e-6 at h = 0.54. One term replaces
/// the infinite lower tail, with the tail's weight and mean rate.
/// error: relative, ≤ kGaussianSumError at every u.  terms: about (ln(highest / lowest) + 6) / 0.54.
/// source: the exponential-sum quadrature of [Beylkin05 §3].
GaussianSum inverse_square(double lowest, double highest);

}  // namespace symrig::sim
