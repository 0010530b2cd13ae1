// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hdr/merge.hpp"

#include <span>
#include <string>
#include <vector>

namespace symrig {

/// The ratio of two frames of a bracket, from pixels that both see well.
struct ExposureRatio {
  std::size_t shorter = 0, longer = 0;  ///< numbers of the frames
  double stated = 1;                    ///< ratio of their stated exposures
  double seen = 1;                      ///< ratio of their pixels
  double sigma = 0;                     ///< standard error of seen, relative
  std::int64_t pixels = 0;              ///< number of pixels that both see well
  double imperfect = 0.005;             ///< what imperfect shutters and sensors can cause, relative

  /// True if the stated ratio is wrong: it differs by more than 5 standard errors and by more than
  /// `imperfect`.
  bool wrong() const;
  /// "frame 2 is 7.62 times frame 1 by its pixels (±0.01), 8 times by its exposures: off by 4.8 %"
  std::string to_string() const;
};

/// Ratios of neighbouring exposures from their overlap. Iterated total least squares gives the slope of
/// d_long = r d_short, with noise in both: r = Σ w d_long / Σ w d_short. A mean of ratios would be biased.
/// Saturated samples and samples below 5 σ are not used; a mean of both frames decides, so that the noise of
/// neither selects. Pairs with fewer than 64 common pixels are omitted from the result. fails: bad_argument
/// (exposures, noise model), size_mismatch.
Result<std::vector<ExposureRatio>> exposure_ratios(std::span<const Frame> frames, const NoiseModel& noise);

}  // namespace symrig
