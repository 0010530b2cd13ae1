// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/hdr/exposure_ratio.hpp"
#include "symrig/hdr/merge.hpp"
#include "symrig/hdr/response.hpp"
#include "symrig/image/radiance.hpp"

#include <span>
#include <vector>

namespace symrig {

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

}  // namespace symrig
