// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/coaxial_comb.hpp"

#include <span>

namespace symrig::calibration {

/// r(d): the difference of the light that two stripes d pixels apart send each other, over their direct
/// light.
struct Imbalance {
  int distance = 0;
  double value = 0;
  double sigma = 0;
};

/// A one-sided exponential flare.
struct Flare {
  double share = 0;         ///< of all light; negative: towards smaller positions
  double sigma = 0;         ///< from noise and from the range of lengths that fit equally well
  double length = 1;        ///< [pixels]
  double significance = 0;  ///< √(χ² without flare − χ² with it)
};

/// r(d) of a flare of share 1: (1 − k) k^d, k = exp(−1 / length), over all pairs of groups. The farther pairs
/// see it with the opposite sign.
double flare_imbalance(const Comb& comb, int distance, double length);

/// Least squares over share and length.
Flare fit_flare(std::span<const Imbalance> found, const Comb& comb);

}  // namespace symrig::calibration
