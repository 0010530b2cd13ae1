// SPDX-License-Identifier: Apache-2.0
#include "symrig/image/internal/size_text.hpp"

#include <charconv>
#include <string>

namespace symrig::image {

std::optional<std::pair<int, int>> two_sides(std::string_view text) {
  int a = 0, b = 0;
  const char* const end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, a);
  if (first.ec != std::errc() || first.ptr == end || *first.ptr != 'x') return std::nullopt;
  const auto second = std::from_chars(first.ptr + 1, end, b);
  if (second.ec != std::errc() || second.ptr != end) return std::nullopt;
  if (a < 1 || b < 1 || a > kLargestSide || b > kLargestSide) return std::nullopt;
  return std::pair(a, b);
}

void read_picture_size(base::TableReader& table, std::string_view key, Grid& size) {
  std::string text;
  if (!table.read(key, text)) return;
  const auto sides = two_sides(text);
  if (!sides) return table.fail(key, "\"" + text + "\" is not a size", "give columns x rows, \"1280x1024\"");
  size = {sides->second, sides->first};
}

void read_grid(base::TableReader& table, std::string_view key, std::optional<Grid>& grid) {
  std::string text;
  if (!table.read(key, text)) return;
  const auto sides = two_sides(text);
  if (!sides) return table.fail(key, "\"" + text + "\" is not a grid", "give rows x columns, \"48x64\"");
  grid = Grid{sides->first, sides->second};
}

}  // namespace symrig::image
