// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/screen_reader.hpp"
#include "sim/hash.hpp"

#include <algorithm>
#include <cstring>

namespace symrig::bench_vm {

namespace {

constexpr double kWhite = 255.0 * 3;

std::uint32_t pixel(const ScanoutPixels& pixels, int row, int col) {
  std::uint32_t code = 0;
  std::memcpy(&code,
              pixels.first + static_cast<std::size_t>(row) * pixels.pitch +
                  static_cast<std::size_t>(col) * sizeof code,
              sizeof code);
  return code;
}

/// The sum of red, green and blue.
std::uint32_t brightness(std::uint32_t code) {
  return (code >> 16U & 0xffU) + (code >> 8U & 0xffU) + (code & 0xffU);
}

struct Span {
  int begin;
  int end;
};

/// The screen rows or columns of a cell that are on the screen.
Span cell_span(int first, int number, int cell, int screen) {
  const int begin = first + number * cell;
  return {std::clamp(begin, 0, screen), std::clamp(begin + cell, 0, screen)};
}

double cell_light(const ScanoutPixels& pixels, Span rows, Span cols, int cell) {
  std::uint64_t sum = 0;
  for (int row = rows.begin; row < rows.end; ++row)
    for (int col = cols.begin; col < cols.end; ++col) sum += brightness(pixel(pixels, row, col));
  return static_cast<double>(sum) / (kWhite * cell * cell);
}

}  // namespace

Image<float> light_on_grid(const ScanoutPixels& pixels, const Placement& placement) {
  Image<float> light(placement.grid, 1);
  std::size_t i = 0;
  for (int row = 0; row < placement.grid.rows; ++row) {
    const Span rows = cell_span(placement.top, row, placement.cell, pixels.rows);
    for (int col = 0; col < placement.grid.cols; ++col) {
      const Span cols = cell_span(placement.left, col, placement.cell, pixels.cols);
      light.values()[i++] = static_cast<float>(cell_light(pixels, rows, cols, placement.cell));
    }
  }
  return light;
}

std::uint64_t cell_checksum(const ScanoutPixels& pixels, const Placement& placement) {
  std::uint64_t key = 0;
  for (int row = 0; row < placement.grid.rows; ++row) {
    const int y = placement.top + row * placement.cell + placement.cell / 2;
    if (y < 0 || y >= pixels.rows) continue;
    for (int col = 0; col < placement.grid.cols; ++col) {
      const int x = placement.left + col * placement.cell + placement.cell / 2;
      if (x >= 0 && x < pixels.cols) key = sim::combine(key, pixel(pixels, y, x));
    }
  }
  return key;
}

}  // namespace symrig::bench_vm
