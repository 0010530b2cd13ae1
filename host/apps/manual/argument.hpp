// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// What a shell can offer for a value, besides words.
enum class Value : std::uint8_t { none, other, file, folder };

/// An option or a positional argument of a command, as manual pages and completions need it.
struct Argument {
  std::vector<std::string> names;  ///< "-o", "--output"; a positional argument has none
  std::string type, about, standard;
  bool required = false, list = false;  ///< list: words separated by commas
  Value value = Value::none;
  std::vector<std::string> words;     ///< values that are known, such as the names of scenes
  std::vector<std::string> suffixes;  ///< of the files that a positional argument reads; none: any file

  bool positional() const { return names.empty(); }
};

/// Positional arguments first, then options, both in the order in which the command declares them.
std::vector<Argument> arguments_of(const CLI::App& command);

}  // namespace symrig::apps
