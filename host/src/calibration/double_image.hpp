// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/flare_fit.hpp"

#include <optional>
#include <span>

namespace symrig::calibration {

/// A second picture of the lit pixels, `shift` pixels further along the axis (negative: back).
struct DoubleImage {
  int shift = 0;
  double share = 0, sigma = 0;  ///< of the light
};

/// The suspected place of a second picture, from the photographs of the stripes alone. It is the distance 0 <
/// d < period from every stripe with the most light above that of two pixels before and behind. Indirect
/// light is smooth, and a mirror in the scene has different distances from stripes in different places. So
/// few clean rigs are suspected. nullopt: no excess of `least` of the direct light.
std::optional<int> suspect_double_image(const Comb& comb, std::span<const Radiance> photographs,
                                        double least);

/// The proof, with one more photograph, of stripes at the second picture of the first ones. For a symmetric T
/// the light that goes there minus the light that comes back is 0, for any scene. A flare and a shift change
/// this difference too, but equally at distances three pixels apart. So the difference of the two is the
/// second picture's share. At half a period nothing is proven, because the second pictures of both stripes
/// coincide.
/// there: the photograph of comb.pattern(comb.offsets.front() + distance).
DoubleImage prove_double_image(const Comb& comb, std::span<const Radiance> photographs, const Radiance& there,
                               int distance);

}  // namespace symrig::calibration
