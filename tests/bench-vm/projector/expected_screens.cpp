// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/projector/expected_screens.hpp"

#include "symrig/projector/find_projectors.hpp"

#include <cstdlib>

namespace symrig::bench_vm {
namespace {

constexpr std::size_t kStructured = 12;

/// The value of structured pattern `number` at a pixel.
float structured(std::size_t number, int row, int col, Grid grid) {
  const auto binary = [](bool lit) { return lit ? 1.F : 0.F; };
  const int last_row = grid.rows - 1, last_col = grid.cols - 1;
  switch (number) {
    case 0:
      return 0;
    case 1:
      return 1;
    case 2:
      return binary((row + col) % 2 == 0);
    case 3:
      return binary(row % 2 == 0);
    case 4:
      return binary(col % 2 == 0);
    case 5:
      return binary((row == 0 || row == last_row) && (col == 0 || col == last_col));
    case 6:
      return binary(row == 0 || row == last_row || col == 0 || col == last_col);
    case 7:
      return binary((row / 8 + col / 8) % 2 == 0);
    case 8:
      return static_cast<float>(col % 256) / 255.F;
    case 9:
      return static_cast<float>(row % 256) / 255.F;
    case 10:
      return binary(row == col);
    default:
      return binary(std::int64_t{row} * grid.cols + col < grid.size() / 2);
  }
}

}  // namespace

GuestDisplay display_of(const char* variable) {
  const char* card = std::getenv(variable);
  if (card == nullptr) {
    ADD_FAILURE() << variable << " is not set: this test needs a guest of tests/bench-vm";
    return {};
  }
  const std::string head = std::string(card).substr(std::string(card).rfind('/') + 1) + "-";
  for (const Display& display : find_displays())
    if (display.connected && display.connector.starts_with(head)) return {card, display.connector};
  ADD_FAILURE() << card << " has no connected display";
  return {};
}

std::unique_ptr<DrmProjector> open_projector(const DrmProjectorOptions& options) {
  auto projector = DrmProjector::open(options);
  if (projector) return *std::move(projector);
  ADD_FAILURE() << projector.error().line();
  return nullptr;
}

Pattern pattern_number(std::size_t number, Grid grid) {
  Pattern pattern(grid);
  std::size_t i = 0;
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col, ++i) {
      // Multiplicative hash of position and number: even patterns are binary, odd ones have all 256 greys.
      const std::uint64_t hash = (i + 1) * 0x9E37'79B9'7F4A'7C15ULL ^ number * 0xD1B5'4A32'D192'ED03ULL;
      const auto byte = static_cast<float>((hash ^ hash >> 29U) * 0xBF58'476D'1CE4'E5B9ULL >> 56U);
      pattern.values()[i] = number < kStructured ? structured(number, row, col, grid)
                            : number % 2 == 0    ? (byte < 128 ? 0.F : 1.F)
                                                 : byte / 255.F;
    }
  return pattern;
}

ScreenPixels expected_screen(const Pattern& pattern, const Placement& placement, Grid screen) {
  ScreenPixels pixels;
  pixels.rows = screen.rows;
  pixels.cols = screen.cols;
  pixels.rgb.reserve(screen.size());
  constexpr float kRound = 0.5F;
  for (int y = 0; y < screen.rows; ++y)
    for (int x = 0; x < screen.cols; ++x) {
      const int row = (placement.mirror_rows ? screen.rows - 1 - y : y) - placement.top;
      const int col = (placement.mirror_cols ? screen.cols - 1 - x : x) - placement.left;
      const bool inside = row >= 0 && col >= 0 && row / placement.cell < pattern.grid().rows &&
                          col / placement.cell < pattern.grid().cols;
      const float value = inside ? pattern.at(row / placement.cell, col / placement.cell) : 0.F;
      pixels.rgb.push_back(0x010101U * static_cast<std::uint32_t>(255 * value + kRound));
    }
  return pixels;
}

}  // namespace symrig::bench_vm
