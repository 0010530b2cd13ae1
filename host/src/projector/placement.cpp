// SPDX-License-Identifier: Apache-2.0
#include "symrig/projector/placement.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig {
namespace {

/// The pattern line that a screen line shows, or −1.
int source_of(int at, int length, bool mirror, int offset, int cell, int count) {
  const int unmirrored = (mirror ? length - 1 - at : at) - offset;
  if (unmirrored < 0) return -1;
  const int source = unmirrored / cell;
  return source < count ? source : -1;
}

/// source_of() for each line of the screen in one direction.
std::vector<int> sources(int length, bool mirror, int offset, int cell, int count) {
  std::vector<int> map(length);
  for (int at = 0; at < length; ++at) map[at] = source_of(at, length, mirror, offset, cell, count);
  return map;
}

/// Calls write(row, line) for each screen row; `line` holds its words. Rows of the same cell share a line.
template <class Word, class Code, class ToWord, class Write>
void draw_rows(const Image<Code>& codes, const Placement& at, Grid screen, ToWord to_word, Write write) {
  const auto rows = sources(screen.rows, at.mirror_rows, at.top, at.cell, codes.grid().rows);
  const auto cols = sources(screen.cols, at.mirror_cols, at.left, at.cell, codes.grid().cols);
  std::vector<Word> line(cols.size());
  int held = -1;
  for (int row = 0; row < screen.rows; ++row) {
    const int source = rows[row];
    if (source < 0 && held >= 0) std::fill(line.begin(), line.end(), Word{0});
    if (source >= 0 && source != held)
      std::transform(cols.begin(), cols.end(), line.begin(),
                     [&](int col) { return col < 0 ? Word{0} : to_word(codes.at(source, col)); });
    held = source;
    write(row, line);
  }
}

}  // namespace

Result<Grid> placed_grid(Grid screen, const Placement& placement, std::optional<Grid> asked) {
  if (placement.cell < 1 || placement.top < 0 || placement.left < 0)
    return Error{ErrorCode::bad_argument,
                 fmt::format("patterns cannot have cells of {} pixels at row {}, column {}", placement.cell,
                             placement.top, placement.left),
                 "give a cell of 1 or more, and an offset of 0 or more"};
  const Grid room{std::max(0, screen.rows - placement.top) / placement.cell,
                  std::max(0, screen.cols - placement.left) / placement.cell};
  const Grid grid = asked.value_or(room);
  if (grid.valid() && grid.rows <= room.rows && grid.cols <= room.cols) return grid;
  return Error{
      ErrorCode::size_mismatch,
      fmt::format("patterns of {} in cells of {} pixels at row {}, column {} do not fit a screen of {} "
                  "(rows x columns)",
                  to_string(grid), placement.cell, placement.top, placement.left, to_string(screen)),
      room.valid() ? "at most " + to_string(room) + " fit there" : "move the patterns, or use smaller cells"};
}

void draw(const Image<std::uint8_t>& codes, const Placement& placement, const ScreenMemory& screen) {
  draw_rows<std::uint32_t>(
      codes, placement, screen.grid, [](std::uint8_t code) { return 0x010101U * code; },
      [&](int row, const std::vector<std::uint32_t>& line) {
        std::copy(
            line.begin(), line.end(),
            screen.words.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(row) * screen.pitch));
      });
}

void draw(const Image<std::uint32_t>& words, const Placement& placement, const ScreenMemory& screen) {
  draw_rows<std::uint32_t>(
      words, placement, screen.grid, [](std::uint32_t word) { return word; },
      [&](int row, const std::vector<std::uint32_t>& line) {
        std::copy(
            line.begin(), line.end(),
            screen.words.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(row) * screen.pitch));
      });
}

Image<std::uint8_t> draw(const Image<std::uint8_t>& codes, const Placement& placement, Grid screen) {
  Image<std::uint8_t> picture(screen);
  draw_rows<std::uint8_t>(
      codes, placement, screen, [](std::uint8_t code) { return code; },
      [&](int row, const std::vector<std::uint8_t>& line) {
        std::copy(line.begin(), line.end(),
                  picture.values().begin() + static_cast<std::ptrdiff_t>(row) * screen.cols);
      });
  return picture;
}

}  // namespace symrig
