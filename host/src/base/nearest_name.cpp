// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/nearest_name.hpp"

#include <algorithm>
#include <cctype>
#include <numeric>
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

}  // namespace symrig
