// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/gray_code.hpp"

#include <optional>

namespace symrig::calibration {

/// Looks for what ruins a sequence before anything is decoded, and names the photographs that the evidence
/// singles out, or the explanations that fit: a white that is saturated (over 2 % of the pixels that the
/// projector lights hold the largest code); sums of pairs that are not one picture (check_sums); a camera or
/// scene that moved by more than a quarter of a pixel; stripes that contradict their order (judge_order);
/// positions beyond the projector. Only pixels that the projector lights are looked at, however few they are;
/// what is seen of them is compared with the noise that the photographs show. Photographs of `held_out` are
/// not looked at. fails: bad_value.
Result<void> check_sequence(const CodePhotographs& photographs, const std::optional<int>& held_out);

}  // namespace symrig::calibration
