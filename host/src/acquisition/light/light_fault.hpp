// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <string>
#include <vector>

namespace symrig::acquisition {

/// A cause that the evidence fits, and what to do.
struct LightCause {
  std::string text;
  std::string next;
};

/// What contradicts the patterns, and what may be the cause: the likeliest first, at most three.
struct LightFault {
  std::string measured;
  std::vector<LightCause> causes;

  /// wrong_light; the next step is that of the first cause.
  Error error() const;
};

/// Faults and causes that several tests find.
LightCause late_frame();
LightCause stuck_pixels();
std::vector<LightCause> causes_of_missing_light();
/// equal: all photographs are the same, with the same noise.
std::vector<LightCause> causes_of_constant_light(bool equal);
/// black: the light under a black pattern, as a share of that under a white one.
LightCause other_light(double black);
/// share: of the light of the pattern before.
LightFault afterglow(double share);
/// less: how much darker pixels beside lit ones are than others, as a share of the light of lit ones.
LightFault sharpening(double less);

/// Sums of light must be this many standard deviations from what is expected: there are a hundred of them.
inline constexpr double kLightSigmas = 6;

/// "12 %"
std::string percent_of_light(double share);

}  // namespace symrig::acquisition
