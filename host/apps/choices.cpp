// SPDX-License-Identifier: Apache-2.0
#include "choices.hpp"

#include <map>

namespace symrig::apps {
namespace {

/// CLI11 has no place for it: a check with a list would write the list into the help, and refuse without the
/// nearest word. An option lives as long as the process, so its address names it.
std::map<const CLI::Option*, std::vector<std::string>>& recorded() {
  static std::map<const CLI::Option*, std::vector<std::string>> words;
  return words;
}

}  // namespace

CLI::Option* takes_words(CLI::Option* option, std::span<const std::string_view> words) {
  std::vector<std::string>& known = recorded()[option];
  known.assign(words.begin(), words.end());
  return option;
}

const std::vector<std::string>& words_of(const CLI::Option& option) {
  static const std::vector<std::string> none;
  const auto found = recorded().find(&option);
  return found == recorded().end() ? none : found->second;
}

}  // namespace symrig::apps
