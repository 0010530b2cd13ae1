// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/joined_screens.hpp"

#include <vector>

#include <gtest/gtest.h>

namespace symrig::bench_vm::joined_screens_test {
namespace {

using namespace std::chrono_literals;

Picture picture(float left, float right) {
  Image<float> image(Grid{2, 2}, 1);
  for (std::size_t i = 0; i < 4; ++i) image.values()[i] = i % 2 == 0 ? left : right;
  return std::make_shared<const Image<float>>(std::move(image));
}

std::vector<float> values_of(const ScreenTimeline::Lit& lit) {
  return {lit.pattern->values().begin(), lit.pattern->values().end()};
}

// Two screens that refresh at different times: while only the left one has changed, the scene sees the new
// picture beside the old one.
TEST(JoinedScreens, change_one_after_the_other) {
  JoinedScreens screens(2);
  screens.change(0, 10ns, picture(1, 2));
  screens.change(1, 10ns, picture(3, 4));
  screens.change(0, 100ns, picture(5, 6));
  screens.change(1, 107ns, picture(7, 8));
  const auto lit = screens.during(80ns, 120ns);
  ASSERT_EQ(lit.size(), 3U);
  EXPECT_EQ(values_of(lit[0]), (std::vector<float>{1, 2, 3, 4, 1, 2, 3, 4}));
  EXPECT_EQ(values_of(lit[1]), (std::vector<float>{5, 6, 3, 4, 5, 6, 3, 4}));
  EXPECT_EQ(values_of(lit[2]), (std::vector<float>{5, 6, 7, 8, 5, 6, 7, 8}));
  EXPECT_DOUBLE_EQ(lit[0].share, 0.5);
  EXPECT_DOUBLE_EQ(lit[1].share, 7.0 / 40);
  EXPECT_DOUBLE_EQ(lit[2].share, 13.0 / 40);
  EXPECT_EQ(values_of(screens.newest()), values_of(lit[2]));
}

// Its light is computed once: number and picture stay.
TEST(JoinedScreens, stay_one_picture_while_nothing_changes) {
  JoinedScreens screens(2);
  screens.change(0, 10ns, picture(1, 2));
  screens.change(1, 20ns, picture(3, 4));
  const auto first = screens.during(30ns, 40ns), second = screens.during(50ns, 60ns);
  ASSERT_EQ(first.size(), 1U);
  ASSERT_EQ(second.size(), 1U);
  EXPECT_EQ(first[0].share, 1);
  EXPECT_EQ(first[0].number, second[0].number);
  EXPECT_EQ(first[0].pattern, second[0].pattern);
  screens.forget_before(60ns);
  EXPECT_EQ(screens.during(60ns, 70ns)[0].number, first[0].number);
}

TEST(JoinedScreens, are_dark_where_one_is_off) {
  JoinedScreens screens(2);
  EXPECT_TRUE(screens.during(0ns, 10ns).empty());
  EXPECT_EQ(screens.newest().pattern, nullptr);
  screens.change(1, 20ns, picture(3, 4));
  EXPECT_EQ(values_of(screens.newest()), (std::vector<float>{0, 0, 3, 4, 0, 0, 3, 4}));
}

}  // namespace
}  // namespace symrig::bench_vm::joined_screens_test
