// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/hdr/merge.hpp"
#include "symrig/hdr/noise_model.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig {

/// The response of a camera or projector: light[c] is the relative light of code c. It is finite and rises
/// strictly from 0 at the lowest code to 1 at the highest.
struct ResponseCurve {
  std::vector<double> light;
  std::int64_t samples = 0;  ///< number of samples it was recovered from
  int repaired = 0;          ///< number of codes whose estimates were not rising; 0 with good data

  double operator()(double code) const;  ///< light, linear between codes, clamped outside
  double code_of(double share) const;    ///< the inverse; share: of the largest light, 0..1
};

struct ResponseOptions {
  int bits = 8;
  int low = 0;             ///< codes at or below it are noise or clipped black, and not used
  int high = -1;           ///< codes at or above it are clipped; -1: the largest code
  double smoothness = 30;  ///< λ of [Debevec97]: weight of curvature against one sample's misfit
};

/// [Debevec97]: min Σ w(z)² (g(z) − ln E_i − ln t_k)² + λ Σ w(z)² g''(z)² by sparse normal equations, g = ln
/// light. Weights are zero at and beyond low and high, so that saturated samples have no effect. Isotonic
/// regression makes the result monotone. Codes without samples continue as a straight line in ln light.
/// frames: exposures of one still scene, of any number of pixels, the same in each.
/// fails: bad_argument (fewer than two different exposures), size_mismatch, bad_value (too few codes
/// reached).
Result<ResponseCurve> recover_debevec(std::span<const Frame> frames, const ResponseOptions& options);

/// [Robertson99]: maximum likelihood, alternating between the scene's light and the curve. The same
/// guarantees. fails: as recover_debevec.
Result<ResponseCurve> recover_robertson(std::span<const Frame> frames, const ResponseOptions& options);

/// A curve, and how far two methods differ about it.
struct RecoveredResponse {
  ResponseCurve curve;  ///< [Debevec97]
  double doubt = 0;     ///< largest difference from [Robertson99], as a share of full light
};
/// fails: as recover_debevec and recover_robertson.
Result<RecoveredResponse> recover_response(std::span<const Frame> frames, const ResponseOptions& options);

/// A test of a camera's linearity: (code − pedestal) / exposure of a pixel must be the same in every frame
/// where it is neither dark nor saturated. Uses the mean ratio of neighbouring exposures in bins of the code.
struct Linearity {
  double worst = 0;        ///< largest departure from a straight line, as a share of full scale
  double worst_sigma = 0;  ///< its standard error
  double at_code = 0;      ///< the code of that departure [DN]
  std::int64_t samples = 0;
  /// False if the departure is proven to be larger than a share of full scale.
  bool linear(double share = 0.01) const { return worst - 3 * worst_sigma <= share; }
};
/// fails: bad_argument (fewer than two different exposures), size_mismatch, bad_value (no pixel is well
/// exposed in two frames).
Result<Linearity> test_linearity(std::span<const Frame> frames, const NoiseModel& noise);

/// Non-decreasing least squares fit (pool adjacent violators); weights ≥ 0.
std::vector<double> isotonic(std::span<const double> values, std::span<const double> weights);

}  // namespace symrig
