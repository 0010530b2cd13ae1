// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <string_view>

namespace symrig::base {

/// Writes the whole text.
/// fails: io.
Result<void> write_descriptor(int descriptor, std::string_view text);

}  // namespace symrig::base
