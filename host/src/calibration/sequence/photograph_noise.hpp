// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/gray_code.hpp"

#include <cmath>
#include <optional>
#include <vector>

namespace symrig::calibration {

/// Variance of a pixel of one photograph as a function of its value: constant + slope · level, units of the
/// photographs.
struct NoiseLine {
  double constant = 0, slope = 0;
  double rms = 0;  ///< over all lit pixels and photographs

  /// Variance of pattern − complement, in variances of one photograph. A complement that was computed as
  /// white + black − pattern makes it 2 pattern − white − black: 4 + 1 + 1.
  double in_difference = 2;
  /// Correlation of the differences of two pairs, which then share white + black: 2 / 6.
  double between_pairs = 0;

  double variance(double level) const { return constant + slope * level; }
  double difference_variance(double level) const { return in_difference * variance(level); }
  /// Standard deviation of the sum of `count` squared differences of one pixel, each over its variance.
  double squares_deviation(double count) const {
    return std::sqrt(2 * count * (1 + (count - 1) * between_pairs * between_pairs));
  }
};

/// Level and variance of a group of pixels.
struct NoisePoint {
  double level = 0, variance = 0;
};
/// The line with the least relative squares, both terms >= 0: every point knows its variance to the same
/// relative error. Points of variance 0 are left out.
NoiseLine line_through(const std::vector<NoisePoint>& points);

/// Estimates the noise from the photographs alone. pattern + complement − white − black is zero except for
/// noise and slow changes. Its noise is that of four photographs, whose levels add up to 2 (white + black).
/// The median of each pair removes the slow changes. The line is fitted to robust variances of bins of equal
/// level, with both terms ≥ 0. If the complements were derived, the patterns alone tell the noise
/// (scatter_noise.hpp).
NoiseLine estimate_noise(const CodePhotographs& photographs, const std::optional<int>& held_out);

/// The same from pairs alone: the sum of one pair against the sum of the next. For a sequence whose white and
/// black are not trusted yet. rms is not set.
NoiseLine estimate_repeat_noise(const CodePhotographs& photographs, const std::optional<int>& held_out);

/// Whether the complements were computed as white + black − pattern. Then pattern + complement is exactly
/// white + black in nearly all lit pixels. The sums of real photographs are so in at most two thirds of them,
/// even where noise is below the rounding to codes. Also true for photographs without any noise.
bool complements_are_derived(const CodePhotographs& photographs, const std::optional<int>& held_out);

/// Estimates the noise from patterns, white and black alone, where complements tell nothing.
/// In two patterns of coarse stripes that both light a pixel and its surroundings, or both leave them dark,
/// nearly the same light falls there. The light that came by way of other surfaces differs, but smoothly. So
/// in 3 × 3 pixels the one photograph is p ≈ (g + g_x x + g_y y) q of the other, whatever the texture is.
/// What is left, over 1 + g², is the variance of one photograph. Medians over many windows, in bins of equal
/// level, leave out depth edges. The line through the bins is that of estimate_noise.
NoiseLine estimate_scatter_noise(const CodePhotographs& photographs, const std::optional<int>& held_out);

}  // namespace symrig::calibration
