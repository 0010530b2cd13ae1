// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/report/text.hpp"

#include <cstdint>
#include <string>
#include <string_view>

namespace symrig::apps {

/// The eight colours of ECMA-48 that every colour terminal has; the person chooses how they look.
enum class Colour : std::uint8_t { red = 31, yellow = 33, cyan = 36 };

/// May colours go to this descriptor? Only to a terminal, and not if NO_COLOR is set to anything
/// (https://no-color.org), or the terminal is "dumb" or has no name.
bool takes_colours(int descriptor);

/// The text in bold and in a colour. The text must be printable.
std::string coloured(std::string_view text, Colour colour);

using text::byte_size, text::duration, text::grouped, text::percent;

/// Writes text for people to standard output. Control characters are shown, not sent to the terminal
/// (printable()).
/// fails: io (a closed pipe, a full disk).
Result<void> print(std::string_view text);

/// Writes one printable line to standard error: "symrig capture: what; next step".
void print_error(std::string_view command, std::string_view line);

}  // namespace symrig::apps
