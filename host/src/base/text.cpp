// SPDX-License-Identifier: Apache-2.0

#include "symrig/base/text.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace symrig {
namespace {

std::string lower(std::string_view text) {
  std::string result(text);
  std::transform(result.begin(), result.end(), result.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  return result;
}

/// Whether one contains the other. The shorter one must have at least three letters.
bool part_of_other(std::string_view a, std::string_view b) {
  const std::string_view part = a.size() < b.size() ? a : b;
  const std::string_view whole = a.size() < b.size() ? b : a;
  return part.size() >= 3 && whole.find(part) != std::string_view::npos;
}

/// Largest number of edits: half the letters of a short word, a third of a long one.
std::size_t most_edits(std::string_view given, std::string_view known) {
  const std::size_t letters = std::max(given.size(), known.size());
  return letters <= 4 ? letters / 2 : letters / 3;
}

}  // namespace

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), row(b.size() + 1), next(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    next[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      next[j + 1] = std::min({row[j] + (a[i] == b[j] ? 0 : 1), row[j + 1] + 1, next[j] + 1});
      if (i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j])
        next[j + 1] = std::min(next[j + 1], before[j - 1] + 1);
    }
    std::swap(before, row);
    std::swap(row, next);
  }
  return row.back();
}

std::optional<std::string_view> nearest_name(std::string_view given,
                                             std::span<const std::string_view> known) {
  constexpr std::size_t kLongest = 256;  // letters; longer names are no typing errors
  if (given.empty() || given.size() > kLongest) return std::nullopt;
  const std::string word = lower(given);
  std::optional<std::string_view> nearest;
  std::size_t fewest = 0;
  for (const std::string_view name : known) {
    const std::string other = lower(name);
    const std::size_t edits = edit_distance(word, other);
    if (edits > most_edits(word, other) && !part_of_other(word, other)) continue;
    if (nearest && edits >= fewest) continue;
    nearest = name;
    fewest = edits;
  }
  return nearest;
}

std::string suggestion(std::string_view given, std::span<const std::string_view> known) {
  const auto nearest = nearest_name(given, known);
  return nearest ? fmt::format("did you mean '{}'? ", *nearest) : std::string();
}

std::string listed(std::span<const std::string_view> names) {
  std::string all;
  for (const std::string_view name : names) all += (all.empty() ? "" : ", ") + std::string(name);
  return all;
}

std::string nearest_hint(std::string_view given, std::span<const std::string_view> known) {
  if (known.empty()) return "there are none";
  return suggestion(given, known) + "known: " + listed(known);
}

std::string nearest_hint(std::string_view given, std::span<const std::string> known) {
  return nearest_hint(given, std::vector<std::string_view>(known.begin(), known.end()));
}

namespace {

/// The first UTF-8 character of a text. bytes is 0 if it is not valid.
struct Character {
  std::size_t bytes = 0;
  std::uint32_t code = 0;
};

std::size_t length_of(unsigned char first) {
  if (first < 0x80) return 1;
  if (first >= 0xC2 && first < 0xE0) return 2;
  if (first >= 0xE0 && first < 0xF0) return 3;
  return first >= 0xF0 && first < 0xF5 ? 4 : 0;
}

/// RFC 3629 allows only the shortest form, no surrogates, and nothing above U+10FFFF.
Character first_of(std::string_view text) {
  constexpr std::uint32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};
  const auto first = static_cast<unsigned char>(text.front());
  const std::size_t bytes = length_of(first);
  if (bytes == 0 || bytes > text.size()) return {};
  std::uint32_t code = bytes == 1 ? first : first & (0x7FU >> bytes);
  for (std::size_t k = 1; k < bytes; ++k) {
    const auto next = static_cast<unsigned char>(text[k]);
    if ((next & 0xC0U) != 0x80U) return {};
    code = code << 6U | (next & 0x3FU);
  }
  const bool legal = code >= kLeast[bytes] && code <= 0x10FFFF && (code < 0xD800 || code > 0xDFFF);
  return legal ? Character{bytes, code} : Character{};
}

/// A character that a terminal or a viewer executes instead of showing it.
bool obeyed(std::uint32_t code) {
  if (code == '\n' || code == '\t') return false;
  const bool control = code < 0x20 || (code >= 0x7F && code < 0xA0);
  const bool breaks = code == 0x2028 || code == 0x2029 || code == 0xFEFF;
  const bool turns = code == 0x200E || code == 0x200F || code == 0x061C ||
                     (code >= 0x202A && code <= 0x202E) || (code >= 0x2066 && code <= 0x2069);
  return control || breaks || turns;
}

}  // namespace

std::string printable(std::string_view text) {
  std::string shown;
  shown.reserve(text.size());
  while (!text.empty()) {
    const Character character = first_of(text);
    const std::size_t bytes = std::max<std::size_t>(character.bytes, 1);
    if (character.bytes > 0 && !obeyed(character.code))
      shown += text.substr(0, bytes);
    else
      for (const char byte : text.substr(0, bytes))
        shown += fmt::format("\\x{:02x}", static_cast<unsigned char>(byte));
    text.remove_prefix(bytes);
  }
  return shown;
}

std::string printable_line(std::string_view text) {
  std::string line(text);
  std::replace_if(
      line.begin(), line.end(), [](char c) { return c == '\n' || c == '\r' || c == '\t'; }, ' ');
  return printable(line);
}

Result<std::int64_t> parse_byte_size(std::string_view text) {
  constexpr std::string_view kUnits = "KMGT";
  const auto refused = [&] {
    return Error{ErrorCode::bad_argument, "'" + std::string(text) + "' is no size of memory",
                 "give bytes, or a number with K, M, G or T, such as 4G"};
  };
  std::int64_t number = 0;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), number);
  const std::string_view rest = text.substr(static_cast<std::size_t>(end - text.data()));
  if (failed != std::errc() || number < 1 || rest.size() > 1) return refused();
  if (rest.empty()) return number;
  const std::size_t unit = kUnits.find(rest[0]);
  if (unit == std::string_view::npos) return refused();
  const int shift = 10 * (static_cast<int>(unit) + 1);
  if (number > std::numeric_limits<std::int64_t>::max() >> shift) return refused();
  return number << shift;
}

}  // namespace symrig
