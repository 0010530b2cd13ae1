// SPDX-License-Identifier: Apache-2.0
#include "usage.hpp"

#include "symrig/base/text.hpp"

#include <algorithm>
#include <vector>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

/// The option's name: "--rig" of "--rig=x", "-o" of "-oscene.h5"; empty if the word is not an option. A
/// number below 0 is a value.
std::string option_in(const std::string& word) {
  if (word.size() < 2 || word[0] != '-' || word == "--") return {};
  if (word[1] == '-') return word.substr(0, word.find('='));
  const bool number = (word[1] >= '0' && word[1] <= '9') || word[1] == '.';
  return number ? std::string() : word.substr(0, 2);
}

/// The number of following words that are values of the option, whatever they look like.
std::size_t values_after(const CLI::Option& option, const std::string& word, const std::string& name) {
  const bool joined = word.size() > name.size();
  const int least = std::max(0, option.get_items_expected_min());
  return joined ? 0 : static_cast<std::size_t>(least);
}

/// Long names without their dashes.
std::vector<std::string> option_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back(name);
  return names;
}

std::string no_option(const CLI::App& command, const std::string& name) {
  const std::vector<std::string> names = option_names(command);
  const std::vector<std::string_view> known(names.begin(), names.end());
  const std::size_t dashes = std::min<std::size_t>(name.find_first_not_of('-'), name.size());
  const auto nearest = nearest_name(std::string_view(name).substr(dashes), known);
  const std::string meant = nearest ? fmt::format("; did you mean '--{}'?", *nearest) : std::string();
  return fmt::format("there is no option '{}'{}", name, meant);
}

}  // namespace

std::string no_command(std::string_view word, std::span<const std::string_view> commands) {
  return fmt::format("there is no command '{}'; {}commands: {}", word, suggestion(word, commands),
                     listed(commands));
}

std::optional<std::string> unknown_option(const CLI::App& command, std::span<const std::string> words) {
  for (std::size_t k = 0; k < words.size() && words[k] != "--"; ++k) {
    const std::string name = option_in(words[k]);
    if (name.empty()) continue;
    const CLI::Option* option = command.get_option_no_throw(name);
    if (option == nullptr) return no_option(command, name);
    k += values_after(*option, words[k], name);
  }
  return std::nullopt;
}

std::optional<std::string> empty_value(const CLI::App& command) {
  for (const CLI::Option* option : command.get_options()) {
    if (option->count() == 0 || option->get_items_expected_min() == 0) continue;  // may go without a value
    const auto& values = option->results();
    if (std::any_of(values.begin(), values.end(), [](const std::string& value) { return value.empty(); }))
      return fmt::format("{} is empty; give a value, or remove the option", option->get_name());
  }
  return std::nullopt;
}

}  // namespace symrig::apps
