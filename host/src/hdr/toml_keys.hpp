// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/text.hpp"

#include <algorithm>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include <fmt/format.h>

#define TOML_EXCEPTIONS 0
#define TOML_ENABLE_FORMATTERS 0
#include <toml++/toml.h>

namespace symrig {

/// Refuses unknown keys. They are probably misspelt, and their values would have no effect.
/// path: "sensor.", or empty at the top.  fails: bad_format (the line, the key, and the nearest known one).
inline Result<void> check_keys(const std::filesystem::path& file, const toml::table& table,
                               std::string_view path, std::span<const std::string_view> known) {
  for (const auto& [key, value] : table) {
    const std::string_view name = key;
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    return Error{
        ErrorCode::bad_format,
        fmt::format("{}:{}: there is no key {}{}", file.string(), value.source().begin.line, path, name),
        nearest_hint(name, known)};
  }
  return {};
}

}  // namespace symrig
