// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"

#include <span>
#include <string>

namespace symrig {

/// Whether all values are finite. name: of the picture, for the message.
/// fails: bad_value (NaN or infinity; names the first such pixel).
Result<void> check_finite(const Image<float>& image, const std::string& name);
/// The same for planes of a grid in memory of the caller.
Result<void> check_finite(std::span<const float> values, Grid grid, const std::string& name);

}  // namespace symrig
