// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "simulated_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

// What a merge is held against: the Cramér-Rao bound, and published weights on the same frames.
namespace symrig::test {

/// Does a sample with so many electrons not saturate?
inline bool usable(const NoiseModel& noise, double electrons) {
  return noise.pedestal() + noise.gain() * electrons < noise.saturation_code();
}

/// Cramér-Rao bound of the rate from the samples that do not saturate: 1 / Σ t² / (rate t + floor).
inline double cramer_rao(const NoiseModel& noise, const std::vector<Nanoseconds>& exposures, double rate) {
  double information = 0;
  for (const Nanoseconds t : exposures) {
    const double electrons = rate * seconds(t);
    if (usable(noise, electrons)) information += seconds(t) * seconds(t) / noise.variance(electrons);
  }
  return 1 / information;
}

/// Of an even field: against its true rate.
inline double mean_square_error(const Radiance& merged, double rate) {
  double squares = 0;
  for (const float m : merged.mean.values()) squares += std::pow(static_cast<double>(m) - rate, 2);
  return squares / static_cast<double>(merged.mean.values().size());
}

/// Of a code and its exposure [s].
using Weight = std::function<double(double code, double seconds)>;

/// The same of Σ w x / Σ w per pixel with a published weight; both as they are for a linear camera, saturated
/// samples out.
inline double mean_square_error(const NoiseModel& noise, const std::vector<Frame>& frames, double rate,
                                const Weight& weight) {
  double squares = 0;
  const std::size_t pixels = frames.front().raw.size();
  for (std::size_t i = 0; i < pixels; ++i) {
    double sum = 0, weights = 0;
    for (const Frame& f : frames) {
      if (f.raw[i] >= noise.saturation_code()) continue;
      const double t = seconds(f.exposure);
      const double w = weight(f.raw[i], t);
      sum += w * (f.raw[i] - noise.pedestal()) / noise.gain() / t;
      weights += w;
    }
    squares += std::pow(weights > 0 ? sum / weights - rate : rate, 2);
  }
  return squares / static_cast<double>(pixels);
}

/// [Debevec97 eq. 4]: a hat over the codes. (There in ln E; for a linear camera the mean of E itself is
/// kinder to it: dark samples have no logarithm.)
inline Weight debevec_weight(const NoiseModel& noise) {
  const double top = noise.max_code();
  return [top](double code, double) { return std::max(1e-6, std::min(code, top - code)); };
}

/// [Robertson99]: t² times a Gaussian about the middle code.
inline Weight robertson_weight(const NoiseModel& noise) {
  const double middle = noise.max_code() / 2.0;
  return [middle](double code, double t) {
    const double x = (code - middle) / middle;
    return t * t * std::exp(-4 * x * x);
  };
}

}  // namespace symrig::test
