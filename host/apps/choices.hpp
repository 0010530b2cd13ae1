// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// Records words that an option takes, so that a shell can complete them. It checks nothing: the library
/// knows the words, and refuses others with the nearest one. The type name tells what else the option takes.
CLI::Option* takes_words(CLI::Option* option, std::span<const std::string_view> words);
inline CLI::Option* takes_words(CLI::Option* option, const std::vector<std::string_view>& words) {
  return takes_words(option, std::span<const std::string_view>(words));
}

/// The recorded words; none, if there are none.
const std::vector<std::string>& words_of(const CLI::Option& option);

}  // namespace symrig::apps
