// SPDX-License-Identifier: Apache-2.0
#include "numbers.hpp"

#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

/// Removes a leading plus sign, which from_chars does not accept.
std::string_view unsigned_text(std::string_view text) {
  const bool plus = text.size() > 1 && text[0] == '+' && text[1] != '-';
  return plus ? text.substr(1) : text;
}

template <class T>
std::from_chars_result parse(std::string_view text, T& value) {
  return std::from_chars(text.data(), text.data() + text.size(), value);
}

}  // namespace

std::string whole_number_fault(const std::string& text, long long least, long long most) {
  const std::string_view digits = unsigned_text(text);
  long long value = 0;
  const auto [stop, error] = parse(digits, value);
  const bool whole = stop == digits.data() + digits.size() && error != std::errc::invalid_argument;
  if (!whole) return fmt::format("'{}' is not a whole number", text);
  // The conversion later may read 010 as eight.
  const std::string_view figures = digits.substr(digits[0] == '-' ? 1 : 0);
  if (figures.size() > 1 && figures[0] == '0')
    return fmt::format("'{}' begins with a zero; remove the zero", text);
  if (error == std::errc{} && value >= least && value <= most) return {};
  return fmt::format("'{}' is too {}; give {} to {}", text, text[0] == '-' ? "small" : "large", least, most);
}

std::string real_number_fault(const std::string& text) {
  const std::string_view digits = unsigned_text(text);
  double value = 0;
  const auto [stop, error] = parse(digits, value);
  if (stop != digits.data() + digits.size() || error == std::errc::invalid_argument)
    return fmt::format("'{}' is not a number", text);
  if (error == std::errc::result_out_of_range) return fmt::format("'{}' does not fit a 64-bit number", text);
  return std::isfinite(value) ? std::string() : fmt::format("'{}' is not a finite number", text);
}

std::optional<int> plain_number(std::string_view text) {
  int number = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || stop != text.data() + text.size()) return std::nullopt;
  return number;
}

std::optional<std::pair<int, int>> two_numbers(std::string_view text, char between) {
  const std::size_t at = text.find(between);
  if (at == std::string_view::npos) return std::nullopt;
  const auto first = plain_number(text.substr(0, at));
  const auto second = plain_number(text.substr(at + 1));
  if (!first || !second) return std::nullopt;
  return std::pair(*first, *second);
}

}  // namespace symrig::apps
