// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/optics_blur.hpp"
#include "symrig/image/outline.hpp"
#include "symrig/image/radiance.hpp"

#include <span>

namespace symrig::calibration {

/// What the camera's pixels see of the combs. All without a ghost.
struct CombPixels {
  Grid cells;
  std::span<const CornerMap> corners;  ///< one for each channel, or one for all
  const Radiance& flood;               ///< on the camera's grid
  const CombPhotographs& combs;
};

/// Tells the blurs of camera and projector apart, pixel by pixel.
///
/// The camera blurs the product of what the projector shows, s, and the scene's texture ρ. For a Gaussian of
/// variance q, the mean of a product is
///
///   G[ρ s] = Σ_n qⁿ / n! · ∂ⁿG[ρ] · ∂ⁿG[s] = W S + q W′ S′ + q² / 2 · W″ S″ + …
///
/// W = G[ρ] is the flood-lit photograph, so the texture need not be known; S is the comb with both blurs, of
/// variance b. Each tile of 8 × 8 cells has a factor (the direct light's share) and a shift of its own. Least
/// squares, robustly, give b and q for all of them: b by how wide borders are, q by how texture near a border
/// shows. The error is the scatter between tiles. first: of measure_blur(); it is the prior of q. Returns
/// `first` if there are too few pixels.
OpticsBlur fit_comb_blur(const CombPixels& pixels, const OpticsBlur& first);

}  // namespace symrig::calibration
