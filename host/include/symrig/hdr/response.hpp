// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/hdr/merge.hpp"
#include "symrig/hdr/noise_model.hpp"
#include "symrig/image/image.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
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
  ResponseCurve curve;  ///< a straight line, or [Debevec97]
  double doubt = 0;     ///< largest difference from [Robertson99], as a share of full light; 0 if straight
  /// Of a camera whose codes follow a straight line, and no pixel's departs from it by 1 % of its light: its
  /// pedestal and noise, as the frames show them.
  std::optional<NoiseModel> straight;
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

/// A TOML table [response] with the light of every code (docs/sensor.md). Written atomically.  fails: io.
Result<void> save_response(const std::filesystem::path& path, const ResponseCurve& curve);
/// fails: not_found, io, bad_format (file:line; a number of codes that no camera has, or light that does not
/// rise from 0 to 1).
Result<ResponseCurve> load_response(const std::filesystem::path& path);

/// A bracket of a camera that is not linear, as one photograph.
struct ResponseMerge {
  Radiance radiance;                  ///< 1: the light that gives the largest code in one second
  std::vector<double> code_variance;  ///< of each code [DN²], as the bracket itself shows it
  std::vector<ExposureRatio>
      ratios;  ///< of neighbouring exposures; pairs with fewer than 64 common pixels are left out
};

/// Merges frames whose codes are converted to light L by a response curve:
///   mean = Σ w_k L(c_k) / t_k / Σ w_k,  variance = 1 / Σ w_k,  w_k = t_k² / (L'(c)² V(c))
/// with c the code that a common estimate of all frames expects, so that a sample's own noise does not choose
/// its weight. V is the variance of a code: the bracket shows it where several frames see one pixel. V holds
/// all that makes frames differ, so also what moves a little. A sample at or below usable.low, or at or above
/// usable.high, is not used. A pixel without any sample is not valid. error: mean and variance hold as far as
/// the curve does; V is known to 10 % where 256 samples or more show it, and is at least 1/12.
/// fails: bad_argument (fewer than two different exposures, exposure ≤ 0, curve of other bits, empty grid),
/// size_mismatch, bad_value (too few pixels that two frames see).
Result<ResponseMerge> merge_by_response(std::span<const Frame> frames, Grid grid, int channels,
                                        const ResponseCurve& curve, const ResponseOptions& usable);

/// The photographed light of a projector at one of its levels: mean over its pixels, and variance of the
/// mean.
struct FieldLight {
  int level = 0;  ///< the level that was sent, 0 … largest
  double light = 0, variance = 0;
};

/// How a projector turns levels into light, without the black level. Binary patterns, the default, do not
/// need it.
class ProjectorResponse {
 public:
  /// Weighted isotonic fit to photographs of even fields in any number and order: at least black, white and
  /// three levels between. Levels without a photograph are interpolated linearly. largest: white, such as
  /// 255. fails: bad_argument (levels out of range, too few), bad_value (white is not brighter than black; or
  /// a level is darker than a lower one by more than 5 σ, because the lamp changed meanwhile).
  static Result<ProjectorResponse> fit(std::span<const FieldLight> levels, int largest = 255);

  /// Light of a level, minus black, as a share of white's: 0 … 1, never falling.
  double light(int level) const { return curve_.light[level]; }
  /// The largest difference of a light from its nearest level: half the largest step, as a share of white.
  double resolution() const;
  const ResponseCurve& curve() const { return curve_; }

 private:
  ResponseCurve curve_;
};

/// A TOML table [levels] (docs/levels.md): the light of each level. Written atomically.  fails: io,
/// not_found.
Result<void> save_projector_response(const std::filesystem::path& path, const ProjectorResponse& response);
/// The light of the 256 levels from 0 to 1, never falling: the input of CodeTable::from_light.
/// fails: not_found, io, bad_format (file:line, legal values).
Result<std::vector<double>> load_projector_light(const std::filesystem::path& path);

}  // namespace symrig
