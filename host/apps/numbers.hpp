// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// Why a text is not a whole number from least to most; empty if it is one. The parser alone reads 010 as
/// eight, and clamps a number that does not fit 64 bits.
std::string whole_number_fault(const std::string& text, long long least, long long most);
/// Why a text is not a finite decimal number; empty if it is one.
std::string real_number_fault(const std::string& text);

/// A whole number and nothing else: "-3".
std::optional<int> plain_number(std::string_view text);
/// Two whole numbers with a separator: "3x2", "0,1".
std::optional<std::pair<int, int>> two_numbers(std::string_view text, char between);

/// Makes an option accept numbers only, before they are converted. The code that uses a number checks its
/// range.
template <class T>
CLI::Option* takes_number(CLI::Option* option) {
  if constexpr (std::is_floating_point_v<T>) {
    return option->check(real_number_fault);
  } else {
    const auto fault = [](const std::string& text) {
      return whole_number_fault(text, std::numeric_limits<T>::min(), std::numeric_limits<T>::max());
    };
    return option->check(fault);
  }
}

}  // namespace symrig::apps
