// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/raw_map.hpp"

namespace symrig::calibration {

/// Scales the stated standard deviations of one axis to the scatter of its positions.
/// How wrong a footprint's model is depends on the optics, so one constant (DecodePolicy::model_error) is too
/// large for one sequence and too small for another. Positions on a surface show it: their third difference
/// d = x₀ − 3 x₁ + 3 x₂ − x₃ is 0 for each position that bends like a parabola. If errors are independent,
/// its variance is V = σ₀² + 9 σ₁² + 9 σ₂² + σ₃². So 1.4826 median |d| / √V is the factor that is missing.
/// Errors repeat with the stripes. Pixels that see the same part of a stripe err alike, and pixels half a
/// period apart err oppositely: d is too small for the one, too large for the other. So the four pixels are 1
/// and 2 camera pixels apart, and the mean square of both factors counts. Stripes that follow the rows or
/// columns of the picture err alike along them, so the larger factor of both directions counts.
/// clarity: contrast over noise of a photograph. Noise and model dominate in other pixels, so four groups of
/// equal clarity have a factor each, and pixels between their middles one between theirs. Unchanged, if there
/// are fewer than 200 windows. error: a part of the error that is the same over a window stays unknown.
void scale_to_scatter(Image<float>& sigma, const RawMap& map, StripeAxis axis, const Image<float>& clarity);

}  // namespace symrig::calibration
