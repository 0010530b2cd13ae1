// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace symrig::apps {

/// Text that roff prints as it stands.
std::string roff(std::string_view text);
std::string bold(std::string_view text);
std::string italic(std::string_view text);

/// The end of a help as sections of a manual page: "Example:" and "Exit codes:" have sections of their own.
/// In the others, "  name  text" is a row of a table.
std::string footer_sections(std::string_view footer);

}  // namespace symrig::apps
