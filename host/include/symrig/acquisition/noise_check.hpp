// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <string>
#include <vector>

namespace symrig {

/// Whether the photographs scatter as their variances state, independently of each other and from pixel to
/// pixel. Estimated from photographs that a capture takes anyway: the flood-lit ones, and two halves that add
/// up to one. NaN: there was nothing to estimate it from.
struct NoiseCheck {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  /// Scatter between flood-lit photographs over their stated variances, in squares; 1 is as it should be.
  double variance_ratio = kUnknown;
  /// What the two halves and the flood-lit photographs do not add up to, over their stated variances, in
  /// squares. Above 1 where all photographs share noise, 1 otherwise.
  double shared_ratio = kUnknown;
  /// Correlation of the noise of neighbouring pixels; the larger one of rows and columns.
  double neighbours = kUnknown;
  /// Lamp: RMS change of the level between photographs of the same light, as a share.
  double lamp = kUnknown;
  /// What is grossly wrong, a sentence each with its evidence; empty: nothing.
  std::vector<std::string> findings = {};
};

}  // namespace symrig
