// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/clear_pixels.hpp"
#include "calibration/sequence_cause.hpp"

#include <vector>

namespace symrig::calibration {

/// Other orders in which the photographs are a right sequence: one late, a lost or a doubled photograph,
/// backwards, beginning elsewhere, patterns before complements, finest stripes first. Of such an order, the
/// pairs add up to one picture, and where the code of neighbouring pixels differs, it differs by one. Empty
/// if the given order is as good, or if no order fits.
std::vector<Cause> find_arrangements(const CodePhotographs& photographs, const ClearPixels& clear);

}  // namespace symrig::calibration
