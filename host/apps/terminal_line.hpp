// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace symrig::apps {

/// Upper bound on the columns of a text on a terminal: a character that may be two columns wide counts as
/// two.
std::size_t columns_of(std::string_view text);

/// The longest beginning of a text that fits, cut between characters.
std::string cut_to(std::string_view text, std::size_t columns);

/// The first form that fits; if none fits, the last one, cut.
std::string fitting(std::span<const std::string> forms, std::size_t columns);

/// Present number of columns of the terminal behind a file descriptor; 80 if it is not known.
std::size_t terminal_columns(int descriptor);

}  // namespace symrig::apps
