// SPDX-License-Identifier: Apache-2.0

#include "symrig/projector/projector.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace symrig {

Result<Shown> Projector::show(std::size_t /*index*/) {
  return Error{ErrorCode::bad_argument, describe() + " advances by its trigger line",
               "let the board advance it"};
}

Result<void> Projector::load_planes(std::span<const Pattern> /*patterns*/,
                                    std::span<const PlanePlan> /*plans*/) {
  return Error{ErrorCode::bad_argument, describe() + " shows whole pictures", "load patterns"};
}

Result<Shown> Projector::play(std::span<const std::size_t> /*order*/) {
  return Error{ErrorCode::bad_argument, describe() + " shows whole pictures", "load patterns"};
}

Result<std::vector<ShownPicture>> Projector::played() {
  return Error{ErrorCode::bad_argument, describe() + " shows whole pictures", "load patterns"};
}

std::string Projector::setting_for_planes(std::span<const int> /*seen*/) const {
  return {};
}

namespace {

constexpr std::size_t kCodes = 256;

}  // namespace

Result<CodeTable> CodeTable::from_light(std::span<const double> light) {
  if (light.size() != kCodes)
    return Error{ErrorCode::bad_argument, fmt::format("a response has {} values", light.size()),
                 "give the light at each of the 256 codes"};
  for (std::size_t code = 0; code < kCodes; ++code)
    if (!std::isfinite(light[code]) || (code > 0 && light[code] < light[code - 1]))
      return Error{ErrorCode::bad_value, fmt::format("a response has {} at code {}", light[code], code),
                   "give finite values that never decrease"};
  const double range = light.back() - light.front();
  if (!(range > 0) || !std::isfinite(range))
    return Error{ErrorCode::bad_value, "a response is equal at codes 0 and 255", "measure it again"};
  CodeTable table;
  table.light_.reserve(kCodes);
  for (const double value : light) table.light_.push_back((value - light.front()) / range);
  return table;
}

std::uint8_t CodeTable::code(float v) const {
  if (v <= 0) return 0;
  if (v >= 1) return 255;
  if (light_.empty()) return static_cast<std::uint8_t>(std::lround(std::floor(255. * v + 0.5)));
  // `above` is the first code that is at least as bright. The last darker code may be nearer. Of several
  // equally bright codes, the lowest one is used.
  const auto above = std::lower_bound(light_.begin(), light_.end(), double{v});
  if (above == light_.begin()) return 0;
  const double below = *(above - 1);
  const auto nearest = *above - v < v - below ? above : std::lower_bound(light_.begin(), above, below);
  return static_cast<std::uint8_t>(nearest - light_.begin());
}

Result<Image<std::uint8_t>> to_codes(const Pattern& pattern, Grid grid, const CodeTable& table,
                                     std::size_t number) {
  if (pattern.grid() != grid || pattern.channels() != 1)
    return Error{ErrorCode::size_mismatch,
                 fmt::format("pattern {} is {} with {} channels, but the projector shows {} with 1", number,
                             to_string(pattern.grid()), pattern.channels(), to_string(grid)),
                 "give patterns on the projector's grid"};
  Image<std::uint8_t> codes(grid);
  const auto values = pattern.values();
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!(values[i] >= 0 && values[i] <= 1))
      return Error{ErrorCode::bad_value,
                   fmt::format("pattern {} is {} at row {}, column {}", number, values[i],
                               static_cast<int>(i) / grid.cols, static_cast<int>(i) % grid.cols),
                   "give values from 0 to 1"};
    codes.values()[i] = table.code(values[i]);
  }
  return codes;
}

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
