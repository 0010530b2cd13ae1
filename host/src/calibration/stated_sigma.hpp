// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/raw_map.hpp"

namespace symrig::calibration {

/// Scales the stated standard deviations of one axis to the scatter of its positions.
/// How wrong a footprint's model is depends on the optics, so one constant (DecodePolicy::model_error) is too
/// large for one sequence and too small for another. Positions on a surface show it: the sum
/// Σ w_k x_k over 3 × 3 pixels, with w = (1, −2, 1)ᵀ (1, −2, 1), is 0 for every position that bends along
/// rows or columns only. Its variance is Σ w_k² σ_k². So 1.4826 median |Σ w x| / √(Σ w² σ²) is the factor
/// that is missing. Errors of pixels that see the same part of a stripe are alike and cancel. So the pixels
/// of a window are 1, 2, 3 or 5 camera pixels apart, and the largest factor counts. clarity: contrast over
/// noise of a photograph. Noise and model dominate in other pixels, so four groups of equal clarity have a
/// factor each, and pixels between their middles one between theirs. Unchanged, if there are fewer than 200
/// windows. error: a part of the error that is the same over a window stays unknown.
void scale_to_scatter(Image<float>& sigma, const RawMap& map, StripeAxis axis, const Image<float>& clarity);

}  // namespace symrig::calibration
