// SPDX-License-Identifier: Apache-2.0
#include "symrig/hdr/beat.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace symrig {
namespace {

constexpr double kWhole = 1e-3;  // of a period
constexpr int kHarmonics = 4;

double milliseconds(Nanoseconds t) {
  return 1e3 * seconds(t);
}

/// cos and sin of one harmonic fitted to light / mean − 1.
struct Fit {
  double amplitude = 0, variance = 0;  // of the amplitude
  bool determined = false;
};

Fit fit_harmonic(std::span<const TimedLight> frames, double period, int harmonic, double mean) {
  double cc = 0, cs = 0, ss = 0, c1 = 0, s1 = 0, cy = 0, sy = 0;
  const auto n = static_cast<double>(frames.size());
  const auto phase = [&](const TimedLight& frame) {
    return 2 * std::numbers::pi * harmonic * std::fmod(frame.begin_seconds, period) / period;
  };
  for (const TimedLight& frame : frames) {
    const double c = std::cos(phase(frame)), s = std::sin(phase(frame)), y = frame.light / mean - 1;
    c1 += c / n;
    s1 += s / n;
    cc += c * c / n;
    cs += c * s / n;
    ss += s * s / n;
    cy += c * y / n;
    sy += s * y / n;
  }
  // The mean is fitted too: it sums to 0 here, so only the regressors need centring.
  cc -= c1 * c1;
  cs -= c1 * s1;
  ss -= s1 * s1;
  const double determinant = cc * ss - cs * cs;
  if (determinant < 1e-3) return {};
  const double a = (ss * cy - cs * sy) / determinant, b = (cc * sy - cs * cy) / determinant;
  double left = 0;
  for (const TimedLight& frame : frames) {
    const double model = a * (std::cos(phase(frame)) - c1) + b * (std::sin(phase(frame)) - s1);
    const double r = frame.light / mean - 1 - model;
    left += r * r;
  }
  const double noise = left / (n - 3);
  return {std::hypot(a, b), noise * std::max(cc, ss) / determinant / n, true};
}

}  // namespace

Result<BeatForecast> forecast_beat(Nanoseconds exposure, Nanoseconds period, double duty) {
  if (exposure <= Nanoseconds{0} || period <= Nanoseconds{0} || !(duty > 0 && duty <= 1))
    return Error{ErrorCode::bad_argument,
                 fmt::format("no beat between {:.4g} ms and {:.4g} ms at a duty of {}",
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

Result<Beat> find_beat(std::span<const TimedLight> frames, Nanoseconds period) {
  constexpr std::size_t kFewest = 8;
  if (frames.size() < kFewest || period <= Nanoseconds{0})
    return Error{
        ErrorCode::bad_argument,
        fmt::format("{} frames cannot tell a beat with {:.4g} ms", frames.size(), milliseconds(period)),
        "give eight or more, and a period above 0"};
  double mean = 0;
  for (const TimedLight& frame : frames) mean += frame.light / static_cast<double>(frames.size());
  if (!(mean > 0)) return Error{ErrorCode::bad_value, "the frames are dark", "show a lit pattern"};
  Beat beat;
  bool any = false;
  for (int harmonic = 1; harmonic <= kHarmonics; ++harmonic) {
    const Fit fit = fit_harmonic(frames, seconds(period), harmonic, mean);
    if (!fit.determined) continue;
    const double sigma = std::sqrt(fit.variance);
    const bool stronger = !any || fit.amplitude > beat.amplitude;
    any = true;
    if (stronger) beat = {fit.amplitude, sigma, harmonic};
  }
  if (any) return beat;
  return Error{ErrorCode::bad_value, "all frames open at one phase of the projector: they cannot tell",
               "take frames at other times, such as every 1.3 periods"};
}

std::string Beat::to_string(Nanoseconds period) const {
  if (!found())
    return fmt::format("light does not vary with the projector's {:.4g} ms by more than {:.2g} %",
                       milliseconds(period), 100 * (amplitude + 3 * sigma));
  return fmt::format(
      "light varies by ±{:.2g} % (±{:.2g} %) with the projector's {:.4g} ms, {} times a period: expose whole "
      "periods",
      100 * amplitude, 100 * sigma, milliseconds(period), harmonic);
}

}  // namespace symrig
