// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <string>
#include <type_traits>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// Why a text is no whole number from least to most, or nothing. The parser by itself takes 010 for eight and
/// what 64 bits do not hold for the largest number that they do.
std::string whole_number_fault(const std::string& text, long long least, long long most);
/// Why a text is no finite decimal number, or nothing.
std::string real_number_fault(const std::string& text);

/// Lets an option take numbers only, before they are converted. What they may be is checked where they are
/// used.
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
