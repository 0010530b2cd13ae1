// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hdr/merge.hpp"

#include <span>
#include <string>
#include <vector>

namespace symrig {

/// How two frames of a bracket compare where both see the scene.
struct ExposureRatio {
  std::size_t shorter = 0, longer = 0;  ///< numbers of the frames
  double told = 1;                      ///< by the exposures that came with them
  double seen = 1;                      ///< by their pixels
  double sigma = 0;                     ///< standard error of seen, relative
  std::int64_t pixels = 0;              ///< that both see

  /// What was told cannot be: further off than 5 standard errors and than half a percent, which a shutter's
  /// or a sensor's own imperfections may cause.
  bool wrong() const;
  /// "frame 2 is 7.62 times frame 1 by its pixels (±0.01), 8 times by its exposures: off by 4.8 %"
  std::string to_string() const;
};

/// Ratios of neighbouring exposures from their overlap: r = Σ w d_long / Σ w d_short by total least squares,
/// the slope of d_long = r d_short with both noisy, iterated; samples that are saturated or below 5 σ are
/// left out, chosen by a mean of both that neither's noise decides. A mean of ratios would be biased. Frames
/// whose overlap has fewer than 64 pixels are left out of the answer. fails: bad_argument (exposures, noise
/// model), size_mismatch.
Result<std::vector<ExposureRatio>> exposure_ratios(std::span<const Frame> frames, const NoiseModel& noise);

}  // namespace symrig
