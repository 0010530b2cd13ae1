// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/hdr/expectation.hpp"
#include "symrig/hdr/noise_model.hpp"

#include <vector>

namespace symrig {

/// The limits of the devices and the cost of a frame.
struct ExposureRules {
  Nanoseconds min_exposure{20'000};
  Nanoseconds max_exposure{30'000'000'000};
  /// Exposures must be whole multiples of it (multi-bit patterns made by pulses); 0: any exposure is allowed.
  Nanoseconds whole_periods{0};
  /// The cost of a frame besides its exposure: readout, transfer, memory, merging.
  Nanoseconds each_frame{500'000'000};
  int most_frames = 64;
  /// The plan uses a frame only for pixels up to saturation / headroom.
  double headroom = 1.25;
};

/// How radiance becomes electrons in the sensor.
struct LightPath {
  double scale = 1;  ///< radiance of one electron per second
  double black = 0;  ///< radiance of the dark projector; it fills the well like other light
};

struct BracketPlan {
  std::vector<Nanoseconds> exposures;  ///< shortest first
  /// Mean square noise of the worst part / the wanted noise: at most 1 if the plan meets it.
  double noise = 0;
};

/// Information [s²/e⁻²] of one exposure of t seconds about a rate: t² / Var, 0 if it saturates.
double exposure_information(const NoiseModel& noise, double rate, double seconds, double headroom);

/// Finds the bracket of least cost Σ (t_k + each_frame) whose merge has, in every part of the photograph,
///   Σ_lights pixels / Σ_k information_k  ≤  noise · Σ_lights pixels
/// A pixel that saturates in every frame counts with the square of its radiance. Brackets of up to three
/// exposures are searched exhaustively, with exposures √2 apart. More exposures, and repeats, are added one
/// by one: always the one that reduces the noise most for its cost. If longest_seconds ends this first,
/// BracketPlan::noise is above 1. Departs from [Hasinoff10], which maximises the worst SNR in a given time:
/// here the noise is given, and the time is minimised. fails: bad_argument (nothing expected, rules that no
/// exposure meets, a noise model that is not valid).
Result<BracketPlan> plan_bracket(const Expectation& expected, const LightPath& path, const NoiseModel& noise,
                                 const ExposureRules& rules);

}  // namespace symrig
