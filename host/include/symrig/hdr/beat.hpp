// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"

#include <string>

namespace symrig {

/// How much the light of an exposure varies under a pulsed light (colour wheel, PWM). If the exposure is not
/// a whole number of periods, the collected light depends on when the shutter opens.
struct BeatForecast {
  double periods = 0;  ///< exposure / period
  /// (largest − smallest) / mean of the collected light, for a light that is on for `duty` of its period.
  double spread = 0;
  Nanoseconds nearest_whole{0};  ///< at least one period
  /// True if the spread is larger than `share`.
  bool beats(double share = 0.01) const { return spread > share; }
  /// "exposure 1.60 ms is 0.096 periods of 16.67 ms: its light may vary by 200 %; 16.67 ms is whole"
  std::string to_string(Nanoseconds exposure, Nanoseconds period) const;
};

/// The light collected in n + f periods (0 ≤ f < 1) of a light that is on for a share d of each lies between
/// n d + max(0, f + d − 1) and n d + min(f, d). An exposure within 0.1 % of a period of a whole number of
/// them counts as whole.  fails: bad_argument (exposure or period not above 0, duty not in (0, 1]).
Result<BeatForecast> forecast_beat(Nanoseconds exposure, Nanoseconds period, double duty = 0.5);

}  // namespace symrig
