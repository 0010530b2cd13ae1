// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/letters.hpp"

#include <algorithm>

#include <gtest/gtest.h>

namespace symrig::letters_test {
namespace {

double mean(const Image<float>& image) {
  double sum = 0;
  for (const float v : image.values()) sum += v;
  return sum / static_cast<double>(image.values().size());
}

TEST(Letters, are_a_pattern_on_any_grid) {
  for (const Grid grid :
       {Grid{1, 1}, Grid{1, 9}, Grid{9, 1}, Grid{12, 17}, Grid{310, 350}, Grid{40, 400}, Grid{400, 40}}) {
    const Image<float> picture = letters_pattern(grid);
    ASSERT_EQ(picture.grid(), grid);
    ASSERT_EQ(picture.channels(), 1);
    for (const float v : picture.values()) {
      EXPECT_GE(v, 0);
      EXPECT_LE(v, 1);
    }
    EXPECT_GT(mean(picture), 0) << to_string(grid);
  }
}

// Two lines of three letters take 17 x 19 cells with their margins.
TEST(Letters, on_the_grid_of_their_cells_are_black_and_white) {
  const Image<float> picture = letters_pattern({17, 19});
  for (const float v : picture.values()) EXPECT_TRUE(v == 0.0F || v == 1.0F) << v;
  // The top stroke of S: cells 2 to 5 of the second row; its first cell is empty.
  EXPECT_EQ(picture.at(1, 1), 0.0F);
  EXPECT_EQ(picture.at(1, 2), 1.0F);
  EXPECT_EQ(picture.at(1, 5), 1.0F);
  // The margin.
  for (int col = 0; col < 19; ++col) EXPECT_EQ(picture.at(0, col) + picture.at(16, col), 0.0F);
}

TEST(Letters, stand_on_one_line_where_the_grid_is_wide) {
  const Image<float> picture = letters_pattern({9, 37});  // 6 letters of 6 cells and a margin
  for (const float v : picture.values()) EXPECT_TRUE(v == 0.0F || v == 1.0F) << v;
  EXPECT_EQ(picture.at(1, 1), 0.0F);   // S is open at the left of its first row
  EXPECT_EQ(picture.at(7, 31), 0.0F);  // so is G at its last
  EXPECT_EQ(picture.at(7, 35), 1.0F);
}

// Covered shares add up: twice the cells a side, four times the ink.
TEST(Letters, keep_their_share_of_ink_at_any_size) {
  EXPECT_NEAR(mean(letters_pattern({17, 19})), mean(letters_pattern({170, 190})), 1e-6);
  EXPECT_NEAR(mean(letters_pattern({17, 19})), mean(letters_pattern({51, 57})),
              0.02);  // coverage sampled 8 x 8
}

}  // namespace
}  // namespace symrig::letters_test
