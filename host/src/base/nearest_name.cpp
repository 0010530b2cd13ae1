// SPDX-License-Identifier: Apache-2.0
#include "nearest_name.hpp"

#include <algorithm>
#include <numeric>
#include <vector>

#include <fmt/format.h>

namespace symrig {

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (const char letter : a) {
    std::size_t diagonal = row[0]++;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replace = diagonal + (letter == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replace, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

std::string nearest_hint(std::string_view given, std::span<const std::string_view> known) {
  if (known.empty()) return "there are none";
  const auto nearest = *std::min_element(known.begin(), known.end(), [given](auto a, auto b) {
    return edit_distance(given, a) < edit_distance(given, b);
  });
  std::string all;
  for (const std::string_view name : known) all += (all.empty() ? "" : ", ") + std::string(name);
  return fmt::format("did you mean '{}'? known: {}", nearest, all);
}

std::string nearest_hint(std::string_view given, std::span<const std::string> known) {
  return nearest_hint(given, std::vector<std::string_view>(known.begin(), known.end()));
}

}  // namespace symrig
