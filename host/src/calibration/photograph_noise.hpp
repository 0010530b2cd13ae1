// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/gray_code.hpp"

#include <optional>

namespace symrig::calibration {

/// Variance of a pixel of one photograph as a function of its value: constant + slope · level, units of the
/// photographs.
struct NoiseLine {
  double constant = 0, slope = 0;
  double rms = 0;  ///< over all lit pixels and photographs

  double variance(double level) const { return constant + slope * level; }
};

/// Estimates the noise from the photographs alone. pattern + complement − white − black is zero except for
/// noise and slow changes. Its noise is that of four photographs, whose levels add up to 2 (white + black).
/// The median of each pair removes the slow changes. The line is fitted to robust variances of bins of equal
/// level, with both terms ≥ 0.
NoiseLine estimate_noise(const CodePhotographs& photographs, const std::optional<int>& held_out);

/// The same from pairs alone: the sum of one pair against the sum of the next. For a sequence whose white and
/// black are not trusted yet. rms is not set.
NoiseLine estimate_repeat_noise(const CodePhotographs& photographs, const std::optional<int>& held_out);

}  // namespace symrig::calibration
