// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/gray_code.hpp"

#include <vector>

namespace symrig::calibration {

/// The numbers of photographs that a projector's sequence may have, the complete one first: with or without
/// complements, of both axes or of columns alone.
std::vector<int> legal_lengths(Grid projector);

/// Puts the derived complements between patterns: white + black − pattern.
/// images, names: the patterns, then white, then black.
CodePhotographs with_derived_complements(const GrayCode& code, std::vector<Image<float>> images,
                                         std::vector<std::string> names);

}  // namespace symrig::calibration
