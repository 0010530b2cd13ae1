// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <cstdint>
#include <string_view>

namespace symrig {

/// Bytes of a size as people write it: a whole number, or one with K, M, G or T, powers of 1024: "4G",
/// "512M". fails: bad_argument (no such size, 0, or 2^63 and more).
Result<std::int64_t> parse_byte_size(std::string_view text);

}  // namespace symrig
