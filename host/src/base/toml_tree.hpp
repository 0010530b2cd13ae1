// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace symrig::base {

/// A TOML document as plain values with their line numbers, in the order of the lines.
struct TomlNode {
  enum class Kind : std::uint8_t { text, integer, real, boolean, array, table, other };

  Kind kind = Kind::other;
  int line = 0;     ///< in the file, from 1
  std::string key;  ///< the value's key in its table; empty in arrays
  std::string text;
  std::int64_t integer = 0;
  double real = 0;
  bool boolean = false;
  std::vector<TomlNode> children;  ///< items of an array, values of a table

  /// The kind for messages: "a text", "a number", ...
  std::string_view kind_text() const;
  const TomlNode* find(std::string_view name) const;
};

/// file: its name, for messages.
/// fails: bad_format ("scan.toml:12: " and the parser's message).
Result<TomlNode> parse_toml(std::string_view text, const std::string& file);

}  // namespace symrig::base
