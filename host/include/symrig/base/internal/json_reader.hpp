// SPDX-License-Identifier: Apache-2.0
// What is asked of a text before a parser reads it, and of the numbers that a JSON file from any source has.
#pragma once

#include "symrig/base/result.hpp"

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace symrig {

/// How deep a text may nest. Parsers, and trees that free themselves, call themselves once for each level: a
/// file with 20,000 brackets would use up the stack. Files of symrig nest at most 8 levels deep.
constexpr std::size_t kDeepestNesting = 64;

/// fails: bad_format (arrays and objects more than kDeepestNesting deep). A text that is not JSON may pass.
Result<void> check_json_nesting(std::string_view text);

/// fails: bad_format ("FILE:LINE: ...": arrays, inline tables, or the parts of one dotted key, more than
/// kDeepestNesting deep). A text that is not TOML may pass.
Result<void> check_toml_nesting(std::string_view text, const std::string& file);

}  // namespace symrig

namespace symrig::base {

/// A JSON file has an impossible value. It is caught where the file is read, like the JSON library's own
/// exceptions.
class BadJson : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// 146 years: half of the range of 64 bits.
constexpr std::int64_t kLongestNanoseconds = std::int64_t{1} << 62U;

template <std::integral T>
struct Bounds {
  T least = std::numeric_limits<T>::min();
  T most = std::numeric_limits<T>::max();
};

/// name: for the message. Throws BadJson if the value is not a whole number or out of bounds.
template <std::integral T>
T whole_number(const nlohmann::ordered_json& value, std::string_view name, Bounds<T> bounds = {}) {
  const auto fits = [&bounds](auto number) {
    return std::cmp_greater_equal(number, bounds.least) && std::cmp_less_equal(number, bounds.most);
  };
  if (value.is_number_unsigned()) {
    if (const auto number = value.get<std::uint64_t>(); fits(number)) return static_cast<T>(number);
  } else if (value.is_number_integer()) {
    if (const auto number = value.get<std::int64_t>(); fits(number)) return static_cast<T>(number);
  }
  throw BadJson(fmt::format("'{}' is not a whole number from {} to {}", name, bounds.least, bounds.most));
}

/// The value of a required key.
template <std::integral T>
T whole_number_at(const nlohmann::ordered_json& object, const char* key, Bounds<T> bounds = {}) {
  return whole_number<T>(object.at(key), key, bounds);
}

/// The value of a key, or `missing`.
template <std::integral T>
T whole_number_or(const nlohmann::ordered_json& object, const char* key, T missing, Bounds<T> bounds = {}) {
  return object.contains(key) ? whole_number_at<T>(object, key, bounds) : missing;
}

}  // namespace symrig::base
