// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/radiance.hpp"

#include <optional>
#include <string>

namespace symrig::rig {

/// Sets mean and variance to 0 where valid is 0. Then the first value that no photograph may have: a valid
/// that is not 0 or 1, NaN, infinity, a negative variance. none: all are good.
std::optional<std::string> settle(Radiance& photograph);

/// What a camera that looks through a mirror exchanges.
struct Mirrored {
  bool rows = false, columns = false;
};
void set_right(Radiance& photograph, Mirrored mirrored);

}  // namespace symrig::rig
