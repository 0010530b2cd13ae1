// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/units.hpp"
#include "symrig/hdr/expectation.hpp"
#include "symrig/hdr/noise_model.hpp"

#include <vector>

namespace symrig {

/// What the devices allow and what a frame costs.
struct ExposureRules {
  Nanoseconds min_exposure{20'000};
  Nanoseconds max_exposure{30'000'000'000};
  /// Exposures must be whole multiples of it (multi-bit patterns that are made up in time); 0: any will do.
  Nanoseconds whole_periods{0};
  /// What a frame costs besides its exposure: readout, transfer, memory, merging.
  Nanoseconds each_frame{500'000'000};
  int most_frames = 64;
  /// A frame counts on pixels up to 1 / headroom of its saturation.
  double headroom = 1.25;
};

/// What stands between radiance and the sensor.
struct LightPath {
  double scale = 1;  ///< radiance that one electron per second means
  double black = 0;  ///< radiance that the dark projector leaves: it fills the well like any light
};

struct BracketPlan {
  std::vector<Nanoseconds> exposures;  ///< shortest first
  /// Mean square noise of the worst part over what was wanted: at most 1 where it is met.
  double noise = 0;
};

/// Information [s²/e⁻²] that one exposure of t seconds gives on a rate: t² / Var, 0 if it saturates.
double exposure_information(const NoiseModel& noise, double rate, double seconds, double headroom);

/// The bracket of least cost Σ (t_k + each_frame) whose merge has, in every part of the photograph,
///   Σ_lights pixels / Σ_k information_k  ≤  noise · Σ_lights pixels
/// (a pixel that saturates in every frame counts with the square of its radiance). Up to three exposures are
/// searched exhaustively, √2 apart; more, and repeats, are added one by one, that which buys most noise for
/// its cost. If longest_seconds ends it first, the plan says by how much it misses.
/// Departs from [Hasinoff10], who maximises the worst SNR in a given time: here the noise is given and the
/// time is saved.
/// fails: bad_argument (nothing expected, rules that no exposure meets, noise model unusable).
Result<BracketPlan> plan_bracket(const Expectation& expected, const LightPath& path, const NoiseModel& noise,
                                 const ExposureRules& rules);

}  // namespace symrig
