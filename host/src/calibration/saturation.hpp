// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/sequence_light.hpp"
#include "symrig/base/result.hpp"

#include <optional>
#include <string>

namespace symrig::calibration {

/// What a value is the largest code of, if it is one: "code 4095 of 65535, the largest of 12 bits". Cameras
/// of 8 to 15 bits write their codes into the low or into the high bits of a larger word.
std::optional<std::string> largest_code_at(float value);

/// White is saturated if more than 2 % of the lit pixels stand at the largest value, and it is
/// - CodePhotographs::saturation; or
/// - the largest code of fewer bits; or
/// - any value, although the sums of their pairs differ from pixel to pixel; or
/// - any value without noise: the pixels stand there in all patterns that light them, while darker pixels
///   change from pattern to pattern.
/// error: a scene of one value, without noise, is not refused.  fails: bad_value.
Result<void> check_saturation(const SequenceLight& light);

}  // namespace symrig::calibration
