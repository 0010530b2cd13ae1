// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/grid.hpp"

#include <limits>
#include <string>
#include <vector>

namespace symrig {

/// The errors of `symrig evaluate` (docs/command-line.md), each relative: ‖estimate − truth‖ / ‖truth‖ over
/// all channels.
struct TransportErrors {
  double frobenius =
      0;  ///< (T̃−T)Z over Rademacher Z: an unbiased estimate of the relative Frobenius error (in squares)
  double indirect = 0;         ///< lit cells A, observed cells not-A: transport without the direct light
  double flood = 0;            ///< all projector pixels on
  double relight_bar = 0;      ///< a vertical bar, an eighth of the width
  double relight_random = 0;   ///< random binary pattern
  double relight_natural = 0;  ///< a smooth textured picture
  double bar_indirect = 0;     ///< the bar, seen only outside it [Garg06 Fig. 8]
};

/// The true error lies within value ± half_width in this share of cases.
constexpr double kErrorConfidence = 0.95;

/// An error that is not estimated, and why.
struct ErrorNotGiven {
  std::string key;     ///< "indirect", "relight.bar"
  std::string reason;  ///< one sentence without a full stop
};

/// Errors that were estimated from few samples, with how far off the estimates may be.
struct ErrorEstimate {
  TransportErrors value;       ///< NaN where not given
  TransportErrors half_width;  ///< half of the interval (kErrorConfidence); NaN where not given
  std::vector<ErrorNotGiven> not_given = {};
};

/// How much the gain of the camera's optics differs from the projector's, as the photographs of a search show
/// it by reciprocity: log(c / p) = Σ shape · gain_shapes(). A coaxial rig in which both lose the same light
/// to vignetting has none. A registered rig has what its registration left over.
struct GainMismatch {
  GainShapes shape{};
  double rms = 0;    ///< of the logarithm over the grid
  double sigma = 0;  ///< standard deviation of rms, if there were no mismatch; 0: nothing to tell it from
  bool found = false;

  /// It is found if it is this many standard deviations.
  static constexpr double sigmas = 4;
};

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
