// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/gray_code.hpp"

#include <optional>

namespace symrig::calibration {

/// Looks for faults of a sequence before anything is decoded. Its message names the photographs at fault, or
/// the possible explanations. It finds:
/// - a saturated white: over 2 % of the pixels that the projector lights have the largest code;
/// - sums of pairs that are not one picture (check_sums);
/// - a camera or scene that moved by more than a quarter of a pixel;
/// - stripes that contradict their order (judge_order);
/// - positions outside the projector.
/// It uses only pixels that the projector lights, however few they are, and compares them with the noise of
/// the photographs. It does not use photographs of `held_out`.
/// fails: bad_value.
Result<void> check_sequence(const CodePhotographs& photographs, const std::optional<int>& held_out);

}  // namespace symrig::calibration
