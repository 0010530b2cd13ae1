// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/alignment/coarse_code.hpp"
#include "symrig/base/result.hpp"
#include "symrig/calibration/alignment.hpp"
#include "symrig/image/radiance.hpp"

#include <optional>
#include <span>

namespace symrig::calibration {

/// Photographs of the coarse code that cannot be those of its patterns: dark, inverted, of other patterns, or
/// all alike. Nothing is assumed of the map; each bit of the code lights about half of the cells. The error
/// is wrong_light, with what was measured and the causes that fit.
std::optional<Error> wrong_light_of(const CoarseCode& code, std::span<const Radiance> photographs,
                                    int channel);

/// The same for a camera that has a pixel for each cell, and sees the cells mirrored or turned.
std::optional<Error> wrong_turn_of(const Alignment& alignment);

}  // namespace symrig::calibration
