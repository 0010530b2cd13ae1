// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/flare_fit.hpp"

#include <optional>
#include <span>

namespace symrig::calibration {

/// A second picture of what is lit, so many pixels further along the axis (negative: back).
struct DoubleImage {
  int shift = 0;
  double share = 0, sigma = 0;  ///< of the light
};

/// Where a second picture would have to lie, from the photographs of the stripes alone: the distance 0 < d <
/// period from every stripe at which light stands out most from what is two pixels before and behind.
/// Indirect light is smooth, and a mirror in the scene does not keep one distance from stripes in several
/// places, so that few clean rigs are suspected. nullopt: nothing stands out by `least` of the direct light.
std::optional<int> suspect_double_image(const Comb& comb, std::span<const Radiance> photographs,
                                        double least);

/// The proof, with one more photograph, of stripes that lie where the second picture of the first ones would:
/// what goes there less what comes back is 0 for a symmetric T, whatever the scene. A flare and a shift make
/// it differ, too, but alike at distances three pixels apart: their difference is the second picture's share.
/// Half a period away nothing is proven: there the second pictures of both stripes fall on each other.
/// there: the photograph of comb.pattern(comb.offsets.front() + distance).
DoubleImage prove_double_image(const Comb& comb, std::span<const Radiance> photographs, const Radiance& there,
                               int distance);

}  // namespace symrig::calibration
