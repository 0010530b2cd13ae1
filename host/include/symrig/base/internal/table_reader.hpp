// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/text.hpp"
#include "symrig/base/time.hpp"

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
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

/// The file that is being read, and its first error.
struct ReadContext {
  std::string file;
  Result<void> state = {};
  const TomlNode* lacking = nullptr;  ///< the table with a missing key, if that is the error

  /// Keeps the first error: "scan.toml:12: what; hint".
  void fail(int line, std::string_view what, std::string hint, ErrorCode code = ErrorCode::bad_format);
};

/// Reads the keys of one table one by one. An error goes to the context, and the value stays unchanged.
class TableReader {
 public:
  /// path: such as "rig.camera", for messages; empty at the top level.
  TableReader(const TomlNode& table, std::string path, ReadContext& context);

  int line() const { return table_->line; }
  bool ok() const { return context_->state.ok(); }
  /// The value of a key, if present. The key counts as known from now on.
  const TomlNode* find(std::string_view key);
  bool has(std::string_view key) const { return table_->find(key) != nullptr; }
  /// The line of a key, or of the table if the key is absent.
  int line_of(std::string_view key) const;

  // Each returns true if the key is present and its value is valid.
  bool read(std::string_view key, std::string& value);
  bool read(std::string_view key, bool& value);
  bool read(std::string_view key, Nanoseconds& value);
  bool read(std::string_view key, std::vector<std::string>& value);
  bool read_count(std::string_view key, std::uint64_t& value, std::uint64_t least, std::uint64_t most);
  bool read_whole(std::string_view key, int& value, int least, int most);
  bool read_share(std::string_view key, double& value);
  bool read_number(std::string_view key, double& value, double least, double most);
  template <class T>
  bool read_choice(std::string_view key, T& value, std::span<const std::pair<std::string_view, T>> choices);

  /// To be called after all keys. An unknown key is an error that names the nearest known key and all known
  /// keys. It replaces an error about a missing key of this table, which is often the same key, misspelt.
  void finish();
  void require(std::string_view key, std::string_view form);
  void fail(std::string_view key, std::string_view what, std::string hint);
  std::string path_of(std::string_view key) const;
  ReadContext& context() { return *context_; }

 private:
  std::vector<std::string> known_names() const;
  const TomlNode* expect(std::string_view key, TomlNode::Kind kind, std::string_view form);

  const TomlNode* table_;
  std::string path_;
  ReadContext* context_;
  std::vector<std::string> known_;
};

/// Reads a duration of a file. Returns false, with the error in the context, if it is not a duration.
bool read_duration(const TomlNode& node, std::string_view path, ReadContext& context, Nanoseconds& value);

template <class T>
bool TableReader::read_choice(std::string_view key, T& value,
                              std::span<const std::pair<std::string_view, T>> choices) {
  std::string word;
  if (!read(key, word)) return false;
  std::string all;
  std::vector<std::string_view> known;
  for (const auto& [name, meaning] : choices) {
    if (word == name) {
      value = meaning;
      return true;
    }
    all += (all.empty() ? "\"" : ", \"") + std::string(name) + "\"";
    known.push_back(name);
  }
  fail(key, "\"" + word + "\" is not known", suggestion(word, known) + "legal: " + all);
  return false;
}

}  // namespace symrig::base
