// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/photograph_noise.hpp"

namespace symrig::calibration {

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
