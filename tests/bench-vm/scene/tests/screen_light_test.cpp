// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/screen_reader.hpp"

#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::bench_vm::screen_light_test {
namespace {

/// A screen in memory whose rows are longer than the visible part.
struct FakeScreen {
  int rows, cols;
  std::size_t pitch;
  std::vector<std::uint32_t> memory;

  FakeScreen(int rows_, int cols_)
      : rows(rows_),
        cols(cols_),
        pitch((static_cast<std::size_t>(cols_) + 5) * 4),
        memory((static_cast<std::size_t>(cols_) + 5) * rows_, 0xff123456U) {}
  std::uint32_t& at(int row, int col) { return memory[static_cast<std::size_t>(row) * (pitch / 4) + col]; }
  ScanoutPixels pixels() const {
    return {reinterpret_cast<const std::byte*>(memory.data()), pitch, rows, cols};
  }
  void show(const Placement& placement, const std::vector<int>& codes) {
    for (int row = 0; row < placement.grid.rows * placement.cell; ++row)
      for (int col = 0; col < placement.grid.cols * placement.cell; ++col) {
        const int pixel = row / placement.cell * placement.grid.cols + col / placement.cell;
        at(placement.top + row, placement.left + col) =
            0xff000000U | static_cast<std::uint32_t>(codes[pixel]) * 0x010101U;
      }
  }
};

// All 256 codes of a grey pixel give exactly code/255.
TEST(ScreenLight, reads_every_code_exactly) {
  const Placement placement{{16, 16}, 3, 2, 5};
  FakeScreen screen(60, 70);
  std::vector<int> codes(256);
  for (int i = 0; i < 256; ++i) codes[i] = i;
  screen.show(placement, codes);
  const Image<float> light = light_on_grid(screen.pixels(), placement);
  for (int i = 0; i < 256; ++i) EXPECT_EQ(light.values()[i], static_cast<float>(i / 255.0)) << i;
}

// A pattern that is shifted by one pixel gives mixed cells, not the pattern.
TEST(ScreenLight, is_the_mean_of_a_cell) {
  const Placement placement{{2, 2}, 4, 0, 0};
  FakeScreen screen(8, 9);
  screen.show({{2, 2}, 4, 0, 1}, {255, 0, 0, 255});
  for (int row = 0; row < 8; ++row) screen.at(row, 0) = 0;
  const Image<float> light = light_on_grid(screen.pixels(), placement);
  EXPECT_FLOAT_EQ(light.at(0, 0), 0.75F);
  EXPECT_FLOAT_EQ(light.at(0, 1), 0.25F);
  EXPECT_FLOAT_EQ(light.at(1, 0), 0.F);
  EXPECT_FLOAT_EQ(light.at(1, 1), 0.75F);
}

TEST(ScreenLight, never_reads_past_the_screen) {
  FakeScreen screen(8, 8);
  screen.show({{2, 2}, 4, 0, 0}, {255, 255, 255, 255});
  const Image<float> light = light_on_grid(screen.pixels(), {{3, 2}, 4, -2, 6});
  EXPECT_FLOAT_EQ(light.at(0, 0), 0.25F);  // 2 × 2 of its 4 × 4 pixels are on the screen
  EXPECT_FLOAT_EQ(light.at(1, 0), 0.5F);
  EXPECT_EQ(light.at(0, 1), 0.F);
}

TEST(ScreenLight, a_glance_sees_a_changed_cell) {
  const Placement placement{{3, 4}, 3, 1, 1};
  FakeScreen screen(11, 14);
  std::vector<int> codes(12, 7);
  screen.show(placement, codes);
  const std::uint64_t before = cell_checksum(screen.pixels(), placement);
  for (std::size_t i = 0; i < codes.size(); ++i) {
    auto other = codes;
    other[i] = 8;
    screen.show(placement, other);
    EXPECT_NE(cell_checksum(screen.pixels(), placement), before) << i;
  }
  screen.show(placement, codes);
  EXPECT_EQ(cell_checksum(screen.pixels(), placement), before);
}

}  // namespace
}  // namespace symrig::bench_vm::screen_light_test
