// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace symrig {

/// Text that a terminal shows and does not obey: control characters, bytes that are no UTF-8 and characters
/// that turn the direction of writing become \xNN, byte by byte. Line breaks and tabs stay.
std::string printable(std::string_view text);

/// The same on one line: line breaks and tabs become spaces.
std::string printable_line(std::string_view text);

}  // namespace symrig
