// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/report/text.hpp"

#include <string>
#include <string_view>

namespace symrig::apps {

using text::byte_size, text::duration, text::grouped, text::percent;

/// Writes text for people to standard output. Control characters are shown, not sent to the terminal
/// (printable()).
/// fails: io (a closed pipe, a full disk).
Result<void> print(std::string_view text);

/// Writes one printable line to standard error: "symrig capture: what; next step".
void print_error(std::string_view command, std::string_view line);

}  // namespace symrig::apps
