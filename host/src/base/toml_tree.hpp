// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace symrig::base {

/// A TOML document as plain values that know their line. Keys stay in the file's order.
struct TomlNode {
  enum class Kind : std::uint8_t { text, integer, real, boolean, array, table, other };

  Kind kind = Kind::other;
  int line = 0;     ///< in the file, from 1
  std::string key;  ///< of this value in its table; empty in arrays
  std::string text;
  std::int64_t integer = 0;
  double real = 0;
  bool boolean = false;
  std::vector<TomlNode> children;  ///< items of an array, values of a table

  /// "text", "a number", ...: for messages.
  std::string_view kind_text() const;
  const TomlNode* find(std::string_view name) const;
};

/// file: its name, for messages. fails: bad_format ("scan.toml:12: what the parser objects to").
Result<TomlNode> parse_toml(std::string_view text, const std::string& file);

}  // namespace symrig::base
