// SPDX-License-Identifier: Apache-2.0
// The order of the bits that a DLP controller shows as planes.
#include "projector/dlp/plane_order.hpp"

#include <set>

#include <gtest/gtest.h>

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
