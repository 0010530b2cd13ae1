// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/light/light_series.hpp"
#include "symrig/base/result.hpp"

#include <cstddef>
#include <functional>
#include <span>
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
/// Light that no turned or moved picture explains.
std::vector<LightCause> causes_of_other_pixels();
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

/// Whether the first photographs of a capture can be those of a rig: light adds up, is never negative, and
/// lies where the projector shows it. The tests go from the most general to the most special one; each later
/// one relies on what the earlier ones have found in order.
/// look: asked only if something is wrong, to find out what; may be empty.
/// cost: no photograph if all is well, two if light seems to come from elsewhere, else at most six.
/// fails: wrong_light (LightFault); as look.
Result<void> check_light(const LightSeries& series, const LookAside& look);

/// Photographs that belong to other patterns: late, early, or inverted; else as cause_of_turn().
LightCause cause_of_order(const LightOrder& order);
/// A camera whose picture is mirrored or turned, and where that is set right.
LightCause cause_of_turn(Turn turn);

/// No light in as many photographs, each of one pixel. below_black: all together are below 0.
LightFault no_light(std::size_t photographs, bool below_black);

}  // namespace symrig::acquisition
