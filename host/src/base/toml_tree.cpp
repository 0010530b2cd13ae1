// SPDX-License-Identifier: Apache-2.0
// The only file that uses the TOML library.
#include "base/toml_tree.hpp"

#include "symrig/base/nesting.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#define TOML_EXCEPTIONS 0
#define TOML_ENABLE_FORMATTERS 0
#include <toml++/toml.h>

namespace symrig::base {
namespace {

using Kind = TomlNode::Kind;

TomlNode copy(const toml::node& node, std::string_view key);

TomlNode copy_array(const toml::array& array, TomlNode out) {
  out.kind = Kind::array;
  for (const toml::node& item : array) out.children.push_back(copy(item, ""));
  return out;
}

TomlNode copy_table(const toml::table& table, TomlNode out) {
  out.kind = Kind::table;
  for (const auto& [name, value] : table) {
    out.children.push_back(copy(value, name.str()));
    TomlNode& child = out.children.back();
    // A table from a dotted or nested header has no line: use that of its key.
    if (child.line == 0) child.line = static_cast<int>(name.source().begin.line);
  }
  std::stable_sort(out.children.begin(), out.children.end(),
                   [](const TomlNode& a, const TomlNode& b) { return a.line < b.line; });
  return out;
}

TomlNode copy(const toml::node& node, std::string_view key) {
  TomlNode out;
  out.line = static_cast<int>(node.source().begin.line);
  out.key = key;
  if (const auto* array = node.as_array()) return copy_array(*array, std::move(out));
  if (const auto* table = node.as_table()) return copy_table(*table, std::move(out));
  if (const auto* text = node.as_string()) {
    out.kind = Kind::text;
    out.text = text->get();
  } else if (const auto* integer = node.as_integer()) {
    out.kind = Kind::integer;
    out.integer = integer->get();
  } else if (const auto* real = node.as_floating_point()) {
    out.kind = Kind::real;
    out.real = real->get();
  } else if (const auto* boolean = node.as_boolean()) {
    out.kind = Kind::boolean;
    out.boolean = boolean->get();
  }
  return out;
}

}  // namespace

std::string_view TomlNode::kind_text() const {
  switch (kind) {
    case Kind::text:
      return "a text";
    case Kind::integer:
      return "a whole number";
    case Kind::real:
      return "a number";
    case Kind::boolean:
      return "true or false";
    case Kind::array:
      return "a list";
    case Kind::table:
      return "a table";
    case Kind::other:
      return "a date or time";
  }
  return "something else";
}

const TomlNode* TomlNode::find(std::string_view name) const {
  const auto found = std::find_if(children.begin(), children.end(),
                                  [name](const TomlNode& child) { return child.key == name; });
  return found == children.end() ? nullptr : &*found;
}

Result<TomlNode> parse_toml(std::string_view text, const std::string& file) {
  SYMRIG_CHECK(check_toml_nesting(text, file));
  const toml::parse_result parsed = toml::parse(text, file);
  if (parsed) return copy(parsed.table(), "");
  const toml::parse_error& error = parsed.error();
  return Error{ErrorCode::bad_format,
               fmt::format("{}:{}: {}", file, error.source().begin.line, error.description()),
               "it must be TOML 1.0"};
}

}  // namespace symrig::base
