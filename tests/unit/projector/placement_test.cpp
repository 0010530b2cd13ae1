// SPDX-License-Identifier: Apache-2.0

#include "assert_ok.hpp"
#include "symrig/projector/internal/planes.hpp"
#include "symrig/projector/projector.hpp"

#include <cmath>
#include <limits>
#include <numeric>
#include <set>

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

namespace symrig::test::codes_test {
namespace {

std::vector<double> gamma_response(double exponent, double black, double white) {
  std::vector<double> light(256);
  for (std::size_t code = 0; code < light.size(); ++code)
    light[code] = black + (white - black) * std::pow(static_cast<double>(code) / 255, exponent);
  return light;
}

TEST(Codes, without_a_response_every_code_is_reached_by_its_own_value) {
  const CodeTable table;
  for (int code = 0; code < 256; ++code) {
    EXPECT_EQ(table.code(static_cast<float>(code) / 255.F), code);
    // Just within half a code of it.
    EXPECT_EQ(table.code(static_cast<float>((code + 0.499) / 255)), code);
    if (code > 0) {
      EXPECT_EQ(table.code(static_cast<float>((code - 0.499) / 255)), code);
    }
  }
}

TEST(Codes, binary_values_are_0_and_255_whatever_the_response) {
  for (const double exponent : {0.3, 1., 2.2, 8.}) {
    const auto table = CodeTable::from_light(gamma_response(exponent, 3, 70));
    ASSERT_OK(table);
    EXPECT_EQ(table->code(0), 0);
    EXPECT_EQ(table->code(1), 255);
  }
  std::vector<double> flat_end(256, 1);
  flat_end[0] = 0;
  const auto table = CodeTable::from_light(flat_end);
  ASSERT_OK(table);
  EXPECT_EQ(table->code(1), 255);
  EXPECT_EQ(table->code(0.9F), 1) << "of equally bright codes the lowest";
}

RC_GTEST_PROP(Codes, no_other_code_is_nearer_to_the_light_asked_for, ()) {
  std::vector<double> light(256);
  for (double& value : light) value = *rc::gen::inRange(0, 5);  // with plateaus
  light[0] += 1;
  std::partial_sum(light.begin(), light.end(), light.begin());
  RC_PRE(light.back() > light.front());
  const auto table = CodeTable::from_light(light);
  RC_ASSERT(table.ok());
  const float v = static_cast<float>(*rc::gen::inRange(0, 1001)) / 1000.F;
  const double wanted = light.front() + double{v} * (light.back() - light.front());
  const double got = std::abs(light[table->code(v)] - wanted);
  // Both sides are rounded once or twice: a few ulps of the largest light, at most 1021.
  for (const double each : light) RC_ASSERT(got <= std::abs(each - wanted) + 1e-9);
}

TEST(Codes, responses_that_tell_nothing_are_refused) {
  EXPECT_EQ(CodeTable::from_light(std::vector<double>(255, 1)).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(CodeTable::from_light(std::vector<double>(256, 1)).error().code, ErrorCode::bad_value);
  auto falling = gamma_response(2, 0, 1);
  falling[100] = falling[99] - 0.001;
  EXPECT_EQ(CodeTable::from_light(falling).error().code, ErrorCode::bad_value);
  falling[100] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(CodeTable::from_light(falling).error().code, ErrorCode::bad_value);
  falling = gamma_response(2, 0, 1);
  falling.back() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(CodeTable::from_light(falling).error().code, ErrorCode::bad_value);
}

TEST(Codes, a_pattern_names_its_bad_value) {
  Pattern pattern({3, 4});
  ASSERT_OK(to_codes(pattern, {3, 4}, {}, 0));
  for (const float bad : {-0.01F, 1.01F, std::numeric_limits<float>::quiet_NaN()}) {
    pattern.at(2, 1) = bad;
    const auto codes = to_codes(pattern, {3, 4}, {}, 7);
    ASSERT_FALSE(codes.ok());
    EXPECT_EQ(codes.error().code, ErrorCode::bad_value);
    EXPECT_NE(codes.error().what.find("pattern 7"), std::string::npos) << codes.error().what;
    EXPECT_NE(codes.error().what.find("row 2, column 1"), std::string::npos) << codes.error().what;
  }
  EXPECT_EQ(to_codes(Pattern({4, 3}), {3, 4}, {}, 0).error().code, ErrorCode::size_mismatch);
  EXPECT_EQ(to_codes(Pattern({3, 4}, 3), {3, 4}, {}, 0).error().code, ErrorCode::size_mismatch);
}

}  // namespace
}  // namespace symrig::test::codes_test

// The order of the bits that a DLP controller shows as planes.

namespace symrig::plane_order_test {
namespace {

using namespace projector::dlp;

TEST(PlaneOrder, is_green_red_blue_each_from_its_lowest_bit) {
  const std::vector<int> bits = PlaneOrder{}.bits(24);
  EXPECT_EQ(bits, (std::vector<int>{8,  9,  10, 11, 12, 13, 14, 15, 16, 17, 18, 19,
                                    20, 21, 22, 23, 0,  1,  2,  3,  4,  5,  6,  7}));
  EXPECT_EQ(PlaneOrder{}.bits(3), (std::vector<int>{8, 9, 10}));
}

TEST(PlaneOrder, highest_first_turns_each_colour_round) {
  const PlaneOrder order{{'R', 'G', 'B'}, true};
  EXPECT_EQ(order.bits(9), (std::vector<int>{23, 22, 21, 20, 19, 18, 17, 16, 15}));
}

TEST(PlaneOrder, each_of_the_twelve_is_read_as_it_is_written_and_found_by_its_bits) {
  std::set<std::vector<int>> all;
  for (const char* colours : {"GRB", "GBR", "RGB", "RBG", "BGR", "BRG"})
    for (const char* end : {"", " highest first"}) {
      const auto order = parse_plane_order(std::string(colours) + end);
      ASSERT_TRUE(order) << colours << end;
      EXPECT_EQ(to_string(*order), std::string(colours) + end);
      const std::vector<int> bits = order->bits(24);
      EXPECT_EQ(std::set<int>(bits.begin(), bits.end()).size(), 24U) << "each bit once";
      EXPECT_EQ(order_of_bits(bits), order);
      all.insert(bits);
    }
  EXPECT_EQ(all.size(), 12U);
}

TEST(PlaneOrder, other_texts_and_bits_are_none) {
  for (const char* text : {"", "GR", "GGB", "grb", "GRB lowest first", "GRB "})
    EXPECT_FALSE(parse_plane_order(text)) << text;
  EXPECT_FALSE(order_of_bits(std::vector<int>{9, 8, 10}));
}

}  // namespace
}  // namespace symrig::plane_order_test
