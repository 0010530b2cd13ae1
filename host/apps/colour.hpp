// SPDX-License-Identifier: Apache-2.0
#pragma once

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

}  // namespace symrig::apps
