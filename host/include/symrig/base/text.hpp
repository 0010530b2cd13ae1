// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace symrig {

/// Number of edits from a to b. An edit inserts, deletes or replaces one letter, or exchanges two neighbours.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The known name that is most like `given`. It differs in at most a third of the letters (half for up to
/// four letters), or one contains the other. Upper and lower case count as equal. Nothing if no name is that
/// near, because a wrong guess misleads.
std::optional<std::string_view> nearest_name(std::string_view given, std::span<const std::string_view> known);

/// "did you mean 'gain'? ", or empty.
std::string suggestion(std::string_view given, std::span<const std::string_view> known);

/// The hint for an unknown name: "did you mean 'gain'? known: gain, exposure". If no name is known: "there
/// are none".
std::string nearest_hint(std::string_view given, std::span<const std::string_view> known);
std::string nearest_hint(std::string_view given, std::span<const std::string> known);

/// The names separated by commas: "gain, exposure".
std::string listed(std::span<const std::string_view> names);

/// Text that is safe to print on a terminal. Control characters, bytes that are not UTF-8, and characters
/// that change the writing direction become \xNN, byte by byte. Line breaks and tabs stay.
std::string printable(std::string_view text);

/// As printable(), on one line: line breaks and tabs become spaces.
std::string printable_line(std::string_view text);

/// Bytes of a size as people write it: a whole number, or one with K, M, G or T, powers of 1024: "4G",
/// "512M". fails: bad_argument (no such size, 0, or 2^63 and more).
Result<std::int64_t> parse_byte_size(std::string_view text);

}  // namespace symrig
