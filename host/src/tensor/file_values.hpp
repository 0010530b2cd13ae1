// SPDX-License-Identifier: Apache-2.0
// Which values a file may contain.
#pragma once

#include "symrig/base/result.hpp"

#include <span>
#include <string>

namespace symrig::tensor {

/// Radiances and entries of T stay below this, so that no sum over a picture overflows a float.
constexpr float kLargest = 0x1p60F;
/// The limit for the values of a pattern.
constexpr float kBrightest = 0x1p30F;

/// A part of a file is missing or does not fit the others. Without a hint: h5::read_file() adds it.
Error damaged(const std::string& what);
/// A value that no camera and no scene gives. what: names it.
Error impossible(const std::string& what);
bool all_finite(std::span<const float> values);
/// Checks that every value is finite and |value| < `most`, a power of two. fails: bad_value (the message
/// names `what`).
Result<void> check_values(std::span<const float> values, const std::string& what, float most);

}  // namespace symrig::tensor
