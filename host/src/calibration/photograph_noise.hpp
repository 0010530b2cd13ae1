// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/gray_code.hpp"

#include <optional>

namespace symrig::calibration {

/// Variance of one photograph's pixel against what it shows: constant + slope · level, units of the
/// photographs.
struct NoiseLine {
  double constant = 0, slope = 0;
  double rms = 0;  ///< over all lit pixels and photographs

  double variance(double level) const { return constant + slope * level; }
};

/// From the photographs alone: pattern + complement − white − black is zero but for noise (that of four
/// photographs, whose levels add up to 2 (white + black)) and what changes slowly, which each pair's median
/// takes away. Robust variances of bins of equal level, then a line through them with both terms ≥ 0.
NoiseLine estimate_noise(const CodePhotographs& photographs, const std::optional<int>& held_out);

/// The same from pairs alone, of what one adds up to against the next: for a sequence of which white and
/// black are not trusted yet. rms is not set.
NoiseLine estimate_repeat_noise(const CodePhotographs& photographs, const std::optional<int>& held_out);

}  // namespace symrig::calibration
