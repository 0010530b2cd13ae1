// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/radiance.hpp"

#include <optional>
#include <string>

namespace symrig::rig {

/// Sets mean and variance to 0 where valid is 0. Then the first value that no photograph may have: a valid
/// that is not 0 or 1, NaN, infinity, a negative variance. none: all are good.
std::optional<std::string> settle(Radiance& photograph);

}  // namespace symrig::rig
