// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace symrig::apps {

/// Columns that a text takes on a terminal, at most: what may be two columns wide counts as two.
std::size_t columns_of(std::string_view text);

/// The beginning of a text that fits, cut between letters.
std::string cut_to(std::string_view text, std::size_t columns);

/// The first of several ways to say a thing that fits, or the last one, cut.
std::string fitting(std::span<const std::string> forms, std::size_t columns);

/// Columns of the terminal behind a file descriptor, now; 80 where it does not say.
std::size_t terminal_columns(int descriptor);

}  // namespace symrig::apps
