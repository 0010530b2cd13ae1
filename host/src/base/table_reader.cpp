// SPDX-License-Identifier: Apache-2.0
#include "base/table_reader.hpp"

#include "base/duration.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig::base {

using Kind = TomlNode::Kind;

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
