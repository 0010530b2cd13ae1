// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace symrig {

/// A residual of this many robust sigmas, or more, does not count. Normal residuals then tell as much as 95 %
/// of them would by least squares [Beaton74].
inline constexpr double kTukeyReach = 4.685;

/// How much a residual counts in a robust fit: Tukey's biweight, (1 − u²)² for u = sigmas / kTukeyReach.
/// sigmas: the residual in robust sigmas, of either sign. Result: 0 to 1.
constexpr double tukey_weight(double sigmas) {
  const double u = sigmas / kTukeyReach, rest = 1 - u * u;
  return rest > 0 ? rest * rest : 0;
}

}  // namespace symrig
