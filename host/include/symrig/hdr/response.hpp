// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/units.hpp"
#include "symrig/hdr/merge.hpp"
#include "symrig/hdr/noise_model.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig {

/// How a camera or projector answers: relative light of each code, light[c] for code c, strictly rising from
/// 0 at the lowest to 1 at the highest code, finite.
struct ResponseCurve {
  std::vector<double> light;
  std::int64_t samples = 0;  ///< what it was recovered from
  int repaired = 0;          ///< codes whose estimate would have broken the order; 0 where the data is sound

  double operator()(double code) const;  ///< light, linear between codes, clamped outside
  double code_of(double share) const;    ///< the inverse: share of the largest light, 0..1
};

/// One exposure of a still scene for response recovery. raw: any number of pixels, the same in each.
struct ResponseOptions {
  int bits = 8;
  int low = 0;             ///< codes at or below are noise or clipped black: not used
  int high = -1;           ///< codes at or above are clipped; -1: the largest code
  double smoothness = 30;  ///< λ of [Debevec97]: weight of curvature against one sample's misfit
};

/// [Debevec97]: min Σ w(z)² (g(z) − ln E_i − ln t_k)² + λ Σ w(z)² g''(z)² by sparse normal equations, g = ln
/// light. Weights are zero at and beyond low and high, so that saturated samples say nothing. The result is
/// made monotone by isotonic regression, and codes that no sample reached follow a straight line in ln light.
/// fails: bad_argument (fewer than two different exposures), size_mismatch, bad_value (too few codes
/// reached).
Result<ResponseCurve> recover_debevec(std::span<const Frame> frames, const ResponseOptions& options);

/// [Robertson99]: maximum likelihood by turns: light of the scene from the curve, the curve from the scene.
/// The same guarantees.  fails: as recover_debevec.
Result<ResponseCurve> recover_robertson(std::span<const Frame> frames, const ResponseOptions& options);

/// Is a camera linear? Each pixel's code less pedestal over exposure must be the same in every frame where it
/// is neither dark nor saturated. Bins of code; in each, the mean ratio of neighbouring exposures' rates.
struct Linearity {
  double worst = 0;        ///< largest departure from a straight line, as a share of full scale
  double worst_sigma = 0;  ///< its own standard error
  double at_code = 0;      ///< where [DN]
  std::int64_t samples = 0;
  /// Not proven to be off by more than a share of full scale.
  bool linear(double share = 0.01) const { return worst - 3 * worst_sigma <= share; }
};
/// fails: bad_argument (fewer than two different exposures), size_mismatch, bad_value (no pixel is well
/// exposed in two frames).
Result<Linearity> test_linearity(std::span<const Frame> frames, const NoiseModel& noise);

/// Non-decreasing least squares fit (pool adjacent violators); weights ≥ 0.
std::vector<double> isotonic(std::span<const double> values, std::span<const double> weights);

}  // namespace symrig
