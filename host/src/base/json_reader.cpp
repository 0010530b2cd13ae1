// SPDX-License-Identifier: Apache-2.0

#include "symrig/base/internal/json_reader.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig {
namespace {

/// One pass over a TOML text. Strings and comments do not count.
class TomlScan {
 public:
  explicit TomlScan(std::string_view text) : text_(text) {}

  /// The first line that is too deep; 0 if there is none.
  int first_too_deep() {
    while (at_ < text_.size()) {
      take();
      if (std::max(depth_, parts_) > kDeepestNesting) return line_;
    }
    return 0;
  }

 private:
  void take() {
    const char c = text_[at_];
    if (c == '"' || c == '\'') return skip_string(c);
    if (c == '#') return skip_to_line_end();
    ++at_;
    if (c == '.') ++parts_;
    if (c == '[' || c == '{') ++depth_;
    if ((c == ']' || c == '}') && depth_ > 0) --depth_;
    if (c == '\n') ++line_;
    // A key's parts are counted from the last of these characters.
    if (std::string_view("=,[]{}\n").find(c) != std::string_view::npos) parts_ = 0;
  }

  void skip_to_line_end() { at_ = std::min(text_.find('\n', at_), text_.size()); }

  void skip_string(char quote) {
    const std::string three(3, quote);
    text_.substr(at_).starts_with(three) ? skip_lines(quote, three) : skip_in_line(quote);
  }

  void skip_in_line(char quote) {
    for (++at_; at_ < text_.size() && text_[at_] != '\n'; ++at_) {
      if (text_[at_] == quote) {
        ++at_;
        return;
      }
      if (quote == '"' && text_[at_] == '\\') ++at_;
    }
  }

  /// Skips a string over several lines. Up to two quotes may stand directly before the three that end it.
  void skip_lines(char quote, std::string_view end) {
    for (at_ += 3; at_ < text_.size(); ++at_) {
      if (text_[at_] == '\n') ++line_;
      if (quote == '"' && text_[at_] == '\\') {
        if (++at_ < text_.size() && text_[at_] == '\n') ++line_;
      } else if (text_.substr(at_).starts_with(end)) {
        at_ += 3;
        for (int more = 0; more < 2 && at_ < text_.size() && text_[at_] == quote; ++more) ++at_;
        return;
      }
    }
    at_ = text_.size();
  }

  std::string_view text_;
  std::size_t at_ = 0, depth_ = 0, parts_ = 0;
  int line_ = 1;
};

std::string too_deep() {
  return fmt::format("it nests deeper than {} levels", kDeepestNesting);
}

}  // namespace

Result<void> check_json_nesting(std::string_view text) {
  std::size_t depth = 0;
  bool in_string = false;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const char c = text[at];
    if (in_string && c == '\\') ++at;
    if (c == '"') in_string = !in_string;
    if (in_string) continue;
    if (c == '[' || c == '{') ++depth;
    if ((c == ']' || c == '}') && depth > 0) --depth;
    if (depth > kDeepestNesting)
      return Error{ErrorCode::bad_format, too_deep(), "use a file that symrig wrote"};
  }
  return {};
}

Result<void> check_toml_nesting(std::string_view text, const std::string& file) {
  const int line = TomlScan(text).first_too_deep();
  if (line == 0) return {};
  return Error{ErrorCode::bad_format, fmt::format("{}:{}: {}", file, line, too_deep()),
               "use fewer nested dots, brackets or braces"};
}

}  // namespace symrig
