// SPDX-License-Identifier: Apache-2.0
#include "symrig/hdr/beat.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace symrig {
namespace {

constexpr double kWhole = 1e-3;  // largest difference from whole periods, as a share of a period

double milliseconds(Nanoseconds t) {
  return 1e3 * seconds(t);
}

}  // namespace

Result<BeatForecast> forecast_beat(Nanoseconds exposure, Nanoseconds period, double duty) {
  if (exposure <= Nanoseconds{0} || period <= Nanoseconds{0} || !(duty > 0 && duty <= 1))
    return Error{
        ErrorCode::bad_argument,
        fmt::format("cannot compare an exposure of {:.4g} ms with a period of {:.4g} ms at a duty of {}",
                    milliseconds(exposure), milliseconds(period), duty),
        "give times above 0 and a duty from 0 to 1"};
  BeatForecast beat;
  beat.periods = seconds(exposure) / seconds(period);
  const double nearest = std::max(1.0, std::round(beat.periods));
  beat.nearest_whole = static_cast<std::int64_t>(nearest) * period;
  const double f = beat.periods - std::floor(beat.periods);
  const double low = std::max(0.0, f + duty - 1), high = std::min(f, duty);
  const bool whole = std::abs(beat.periods - nearest) <= kWhole;
  beat.spread = whole ? 0 : (high - low) / (beat.periods * duty);
  return beat;
}

std::string BeatForecast::to_string(Nanoseconds exposure, Nanoseconds period) const {
  return fmt::format(
      "exposure {:.4g} ms is {:.3g} periods of {:.4g} ms: its light may vary by {:.2g} %; {:.4g} ms is whole",
      milliseconds(exposure), periods, milliseconds(period), 100 * spread, milliseconds(nearest_whole));
}

}  // namespace symrig
