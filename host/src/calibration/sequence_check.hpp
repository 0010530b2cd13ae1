// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/gray_code.hpp"

#include <optional>

namespace symrig::calibration {

/// Looks for what ruins a sequence before anything is decoded, and names the photograph: a white one that is
/// saturated (over 2 % of its pixels hold the largest code), a black one that is lit, a pair that does not
/// add up to white + black (another exposure, a photograph that is not of this pair, a camera or scene that
/// moved: more than a quarter of a pixel), a pattern and its complement that are swapped. Photographs of
/// `held_out` are not looked at. fails: bad_value.
Result<void> check_sequence(const CodePhotographs& photographs, const std::optional<int>& held_out);

/// The pair whose pattern and complement are swapped: with one of them the wrong way round, positions jump at
/// every border of its blocks; put right, they do not. nullopt: none would become smoother by it. That the
/// coarsest pair of an axis is swapped does not show here, only in the map's orientation.
std::optional<int> find_swapped_pair(const CodePhotographs& photographs);

}  // namespace symrig::calibration
