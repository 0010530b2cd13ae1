// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace symrig {

/// Text that is safe to print on a terminal. Control characters, bytes that are not UTF-8, and characters
/// that change the writing direction become \xNN, byte by byte. Line breaks and tabs stay.
std::string printable(std::string_view text);

/// As printable(), on one line: line breaks and tabs become spaces.
std::string printable_line(std::string_view text);

}  // namespace symrig
