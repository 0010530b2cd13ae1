// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/units.hpp"

#include <optional>
#include <string>
#include <string_view>

namespace symrig::base {

/// The form of durations in files, for messages.
inline constexpr const char* kDurationForm =
    "a number and a unit in quotes, such as \"1.5 ms\" (ns, us, ms, s)";

/// Parses "14.26 us", "1.5ms", "2 s", rounded to the nearest nanosecond, halves up. Nothing if the text is
/// not a duration, is negative, or is longer than 290 years.
std::optional<Nanoseconds> parse_duration(std::string_view text);

/// A duration as text, exact to the nanosecond and as short as possible: "1.5 ms", "20 us", "40 ns", "2.5 s".
std::string duration_text(Nanoseconds duration);

}  // namespace symrig::base
