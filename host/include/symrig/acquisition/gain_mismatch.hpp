// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/gain_shapes.hpp"

namespace symrig {

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

}  // namespace symrig
