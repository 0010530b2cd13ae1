// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/units.hpp"

#include <span>
#include <string>

namespace symrig {

/// What a light that is made up in time (colour wheel, PWM) does to an exposure that is no whole number of
/// its periods: what the shutter collects depends on when it opens.
struct BeatForecast {
  double periods = 0;  ///< exposure / period
  /// Largest light less smallest, over the mean, for a light that is on for `duty` of its period.
  double spread = 0;
  Nanoseconds nearest_whole{0};  ///< at least one period
  /// True if the spread is above a share of the light.
  bool beats(double share = 0.01) const { return spread > share; }
  /// "exposure 1.60 ms is 0.096 periods of 16.67 ms: its light may vary by 200 %; 16.67 ms is whole"
  std::string to_string(Nanoseconds exposure, Nanoseconds period) const;
};

/// The light collected in n + f periods (0 ≤ f < 1) of a light that is on for a share d of each lies between
/// n d + max(0, f + d − 1) and n d + min(f, d). An exposure within 0.1 % of a period of a whole number of
/// them counts as whole.  fails: bad_argument (exposure or period not above 0, duty not in (0, 1]).
Result<BeatForecast> forecast_beat(Nanoseconds exposure, Nanoseconds period, double duty = 0.5);

/// One exposure of a pattern that does not change.
struct TimedLight {
  double begin_seconds = 0;  ///< when the shutter opened, on the clock that the period is told on
  double light = 0;          ///< mean of the frame, any unit
};

/// Found in frames: light = mean (1 + Σ_h a_h cos(2π h t / P) + b_h sin(…)), h = 1 … 4 (wheels of several
/// segments turn faster than the refresh), least squares, one harmonic at a time.
struct Beat {
  double amplitude = 0;  ///< peak to mean, relative, of the strongest harmonic
  double sigma = 0;      ///< its standard error, from what no harmonic explains
  int harmonic = 1;
  /// Nothing that chance would not do one time in a hundred thousand.
  bool found() const { return amplitude > 5 * sigma; }
  /// "light varies by ±3.1 % (±0.2 %) with the projector's 16.67 ms: expose whole periods"
  std::string to_string(Nanoseconds period) const;
};
/// fails: bad_argument (fewer than 8 frames, period not above 0), bad_value (all frames open at one phase:
/// they cannot tell; or no light).
Result<Beat> find_beat(std::span<const TimedLight> frames, Nanoseconds period);

}  // namespace symrig
