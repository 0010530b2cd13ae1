// SPDX-License-Identifier: Apache-2.0
#include "symrig/projector/placement.hpp"

#include "assert_ok.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace symrig::test::placement_test {
namespace {

/// The law of Placement, pixel by pixel and without a thought of speed.
std::uint8_t expected(const Image<std::uint8_t>& codes, const Placement& at, Grid screen, int y, int x) {
  if (at.mirror_rows) y = screen.rows - 1 - y;
  if (at.mirror_cols) x = screen.cols - 1 - x;
  if (y < at.top || x < at.left) return 0;
  const int row = (y - at.top) / at.cell, col = (x - at.left) / at.cell;
  return row < codes.grid().rows && col < codes.grid().cols ? codes.at(row, col) : 0;
}

struct Case {
  Placement at;
  Grid screen;
  Image<std::uint8_t> codes;
};

/// Any grid and offset on any screen that they fit.
Case any_case() {
  Case made;
  made.at = {*rc::gen::inRange(1, 6), *rc::gen::inRange(0, 9), *rc::gen::inRange(0, 9),
             *rc::gen::arbitrary<bool>(), *rc::gen::arbitrary<bool>()};
  const Grid grid{*rc::gen::inRange(1, 12), *rc::gen::inRange(1, 12)};
  made.screen = {made.at.top + grid.rows * made.at.cell + *rc::gen::inRange(0, 9),
                 made.at.left + grid.cols * made.at.cell + *rc::gen::inRange(0, 9)};
  made.codes = Image<std::uint8_t>(grid);
  for (auto& code : made.codes.values()) code = static_cast<std::uint8_t>(*rc::gen::inRange(0, 256));
  return made;
}

RC_GTEST_PROP(Placement, every_pixel_of_the_screen_follows_the_law, ()) {
  const Case made = any_case();
  const auto picture = draw(made.codes, made.at, made.screen);
  for (int y = 0; y < made.screen.rows; ++y)
    for (int x = 0; x < made.screen.cols; ++x)
      RC_ASSERT(picture.at(y, x) == expected(made.codes, made.at, made.screen, y, x));
}

RC_GTEST_PROP(Placement, memory_of_a_card_gets_the_same_pixels_as_grey_and_nothing_between_rows, ()) {
  const Case made = any_case();
  const std::size_t pitch = made.screen.cols + *rc::gen::inRange(0, 5);
  constexpr std::uint32_t kUntouched = 0xABCD'EF01U;
  std::vector<std::uint32_t> words(pitch * static_cast<std::size_t>(made.screen.rows), kUntouched);
  draw(made.codes, made.at, {words, pitch, made.screen});
  for (int y = 0; y < made.screen.rows; ++y)
    for (std::size_t x = 0; x < pitch; ++x) {
      const std::uint32_t word = words[static_cast<std::size_t>(y) * pitch + x];
      const auto col = static_cast<int>(x);
      RC_ASSERT(word == (col < made.screen.cols
                             ? 0x010101U * expected(made.codes, made.at, made.screen, y, col)
                             : kUntouched));
    }
}

TEST(Placement, the_grid_is_all_cells_that_fit) {
  const auto grid = placed_grid({1140, 912}, {.cell = 8, .top = 4, .left = 16});
  ASSERT_OK(grid);
  EXPECT_EQ(*grid, (Grid{142, 112}));
  const auto asked = placed_grid({1140, 912}, {.cell = 8}, Grid{48, 64});
  ASSERT_OK(asked);
  EXPECT_EQ(*asked, (Grid{48, 64}));
}

TEST(Placement, what_does_not_fit_is_refused) {
  const Grid screen{10, 10};
  EXPECT_EQ(placed_grid(screen, {.cell = 3}, Grid{4, 3}).error().code, ErrorCode::size_mismatch);
  EXPECT_EQ(placed_grid(screen, {.cell = 3, .top = 2}, Grid{3, 3}).error().code, ErrorCode::size_mismatch);
  EXPECT_EQ(placed_grid(screen, {.top = 10}).error().code, ErrorCode::size_mismatch);
  EXPECT_EQ(placed_grid(screen, {.cell = 11}).error().code, ErrorCode::size_mismatch);
  EXPECT_EQ(placed_grid(screen, {.cell = 0}).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(placed_grid(screen, {.left = -1}).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(placed_grid(screen, {}, Grid{0, 5}).error().code, ErrorCode::size_mismatch);
}

}  // namespace
}  // namespace symrig::test::placement_test
