// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/units.hpp"

#include <optional>
#include <string>
#include <string_view>

namespace symrig::base {

/// How durations are written in files.
inline constexpr const char* kDurationForm =
    "a number and a unit in quotes, such as \"1.5 ms\" (ns, us, ms, s)";

/// "14.26 us", "1.5ms", "2 s": to the nearest nanosecond, halves up. None if it is not one, is negative, or
/// is longer than 290 years.
std::optional<Nanoseconds> parse_duration(std::string_view text);

/// "1.5 ms", "20 us", "40 ns", "2.5 s": the shortest that is exact to the nanosecond.
std::string duration_text(Nanoseconds duration);

}  // namespace symrig::base
