// SPDX-License-Identifier: Apache-2.0
#include "capture_options.hpp"

#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <utility>

namespace symrig::apps {
namespace {

/// Names of the library's options, and of the command's options.
constexpr std::array<std::pair<const char*, const char*>, 10> kNames{{
    {"tolerance", "--tolerance"},
    {"dual_threshold", "--dual-threshold"},
    {"dual_subtracts", "--dual-subtract"},
    {"max_patterns", "--max-patterns"},
    {"max_seconds", "--max-seconds"},
    {"target_error", "--target-error"},
    {"photograph_seconds", "--photograph-seconds"},
    {"polish", "--polish"},
    {"split", "--split"},
    {"algorithm", "--algorithm"},
}};

/// Names in the next step of an error. The other names are also plain words.
constexpr std::array<std::pair<const char*, const char*>, 5> kHintNames{{
    {"channel", "--channel"},
    {"resume", "--resume"},
    {"check_axis", "--check-axis"},
    {"algorithm", "--algorithm"},
    {"mosaic", "--mosaic"},
}};

std::string in_command_words(const std::string& text,
                             std::span<const std::pair<const char*, const char*>> names) {
  std::string words;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find_first_of(" ,", begin), text.size());
    const std::string word = text.substr(begin, end - begin);
    const auto found =
        std::find_if(names.begin(), names.end(), [&word](const auto& name) { return name.first == word; });
    words += found == names.end() ? word : found->second;
    if (end < text.size()) words += text[end];
    begin = end + 1;
  }
  return words;
}

}  // namespace

Error in_command_words(Error error) {
  error.what = in_command_words(error.what, kNames);
  return error;
}

Error hint_in_command_words(Error error) {
  error.hint = in_command_words(error.hint, kHintNames);
  return error;
}

Result<void> check_tolerance(const char* option, double value) {
  const auto settings = settings_of({.tolerance = value});
  if (settings) return {};
  Error error = settings.error();
  error.what.replace(0, std::string("tolerance").size(), option);
  return error;
}

}  // namespace symrig::apps
