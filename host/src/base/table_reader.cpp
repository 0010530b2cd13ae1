// SPDX-License-Identifier: Apache-2.0
// The only file that uses the TOML library.

#include "symrig/base/internal/table_reader.hpp"

#include "symrig/base/internal/json_reader.hpp"
#include "symrig/base/time.hpp"

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

void ReadContext::fail(int line, std::string_view what, std::string hint, ErrorCode code) {
  if (state) state = Error{code, fmt::format("{}:{}: {}", file, line, what), std::move(hint)};
}

TableReader::TableReader(const TomlNode& table, std::string path, ReadContext& context)
    : table_(&table), path_(std::move(path)), context_(&context) {
  if (table.kind != Kind::table)
    context.fail(table.line, fmt::format("{} is {}", path_, table.kind_text()), "give a table");
}

std::string TableReader::path_of(std::string_view key) const {
  return path_.empty() ? std::string(key) : fmt::format("{}.{}", path_, key);
}

void TableReader::fail(std::string_view key, std::string_view what, std::string hint) {
  context_->fail(line_of(key), fmt::format("{}: {}", path_of(key), what), std::move(hint));
}

int TableReader::line_of(std::string_view key) const {
  const TomlNode* node = table_->find(key);
  return node == nullptr ? table_->line : node->line;
}

const TomlNode* TableReader::find(std::string_view key) {
  known_.emplace_back(key);
  return table_->find(key);
}

const TomlNode* TableReader::expect(std::string_view key, Kind kind, std::string_view form) {
  const TomlNode* node = find(key);
  if (node == nullptr || node->kind == kind) return node;
  fail(key, fmt::format("is {}", node->kind_text()), fmt::format("give {}", form));
  return nullptr;
}

bool TableReader::read(std::string_view key, std::string& value) {
  const TomlNode* node = expect(key, Kind::text, "a text in quotes");
  if (node != nullptr) value = node->text;
  return node != nullptr;
}

bool TableReader::read(std::string_view key, bool& value) {
  const TomlNode* node = expect(key, Kind::boolean, "true or false");
  if (node != nullptr) value = node->boolean;
  return node != nullptr;
}

bool TableReader::read(std::string_view key, Nanoseconds& value) {
  const TomlNode* node = find(key);
  return node != nullptr && read_duration(*node, path_of(key), *context_, value);
}

bool TableReader::read(std::string_view key, std::vector<std::string>& value) {
  const TomlNode* node = expect(key, Kind::array, "a list of texts");
  if (node == nullptr) return false;
  value.clear();
  for (const TomlNode& item : node->children) {
    if (item.kind != Kind::text) {
      fail(key, fmt::format("an item of the list is {}", item.kind_text()), "give texts in quotes");
      return false;
    }
    value.push_back(item.text);
  }
  return true;
}

bool TableReader::read_count(std::string_view key, std::uint64_t& value, std::uint64_t least,
                             std::uint64_t most) {
  const TomlNode* node = expect(key, Kind::integer, "a whole number");
  if (node == nullptr) return false;
  if (node->integer < 0 || static_cast<std::uint64_t>(node->integer) < least ||
      static_cast<std::uint64_t>(node->integer) > most) {
    fail(key, fmt::format("{} is out of range", node->integer), fmt::format("give {} to {}", least, most));
    return false;
  }
  value = static_cast<std::uint64_t>(node->integer);
  return true;
}

bool TableReader::read_whole(std::string_view key, int& value, int least, int most) {
  auto count = static_cast<std::uint64_t>(value);
  if (!read_count(key, count, static_cast<std::uint64_t>(least), static_cast<std::uint64_t>(most)))
    return false;
  value = static_cast<int>(count);
  return true;
}

bool TableReader::read_share(std::string_view key, double& value) {
  const TomlNode* node = find(key);
  if (node == nullptr) return false;
  const bool whole = node->kind == Kind::integer;
  const double share = whole ? static_cast<double>(node->integer) : node->real;
  if ((!whole && node->kind != Kind::real) || !(share >= 0.001 && share <= 1)) {
    fail(key,
         whole || node->kind == Kind::real ? fmt::format("{} is out of range", share)
                                           : fmt::format("is {}", node->kind_text()),
         "give a share from 0.001 to 1 (1 = no limit)");
    return false;
  }
  value = share;
  return true;
}

bool TableReader::read_number(std::string_view key, double& value, double least, double most) {
  const TomlNode* node = find(key);
  if (node == nullptr) return false;
  const bool whole = node->kind == Kind::integer;
  if (!whole && node->kind != Kind::real) {
    fail(key, fmt::format("is {}", node->kind_text()), "give a number");
    return false;
  }
  const double number = whole ? static_cast<double>(node->integer) : node->real;
  if (!(number >= least && number <= most)) {
    fail(key, fmt::format("{} is out of range", number), fmt::format("give {} to {}", least, most));
    return false;
  }
  value = number;
  return true;
}

void TableReader::require(std::string_view key, std::string_view form) {
  if (has(key)) return;
  if (context_->state) context_->lacking = table_;
  context_->fail(table_->line, fmt::format("{} is missing", path_of(key)), fmt::format("give {}", form));
  known_.emplace_back(key);
}

std::vector<std::string> TableReader::known_names() const {
  std::vector<std::string> names;
  for (const std::string& name : known_)
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  return names;
}

void TableReader::finish() {
  for (const TomlNode& child : table_->children) {
    if (std::find(known_.begin(), known_.end(), child.key) != known_.end()) continue;
    if (context_->lacking == table_) context_->state = {};
    context_->fail(child.line, fmt::format("there is no key {}", path_of(child.key)),
                   nearest_hint(child.key, known_names()), ErrorCode::bad_format);
    return;
  }
}

bool read_duration(const TomlNode& node, std::string_view path, ReadContext& context, Nanoseconds& value) {
  if (node.kind != Kind::text) {
    context.fail(node.line, fmt::format("{} is {}, not a duration", path, node.kind_text()),
                 fmt::format("give {}", kDurationForm));
    return false;
  }
  const auto duration = parse_duration(node.text);
  if (!duration) {
    context.fail(node.line, fmt::format("{}: \"{}\" is not a duration", path, node.text),
                 fmt::format("give {}", kDurationForm));
    return false;
  }
  value = *duration;
  return true;
}

}  // namespace symrig::base
