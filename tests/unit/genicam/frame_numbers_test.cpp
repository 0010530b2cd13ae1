// SPDX-License-Identifier: Apache-2.0
#include "camera/genicam/frame_numbers.hpp"

#include <gtest/gtest.h>

namespace symrig::frame_numbers_test {
namespace {

using camera::FrameNumbers;
using camera::Step;

TEST(FrameNumbers, ids_of_16_bits_skip_0) {
  FrameNumbers numbers;
  EXPECT_EQ(numbers.read(65'534, {}).number, 65'534U);
  EXPECT_EQ(numbers.read(65'535, {}).number, 65'535U);
  const auto after = numbers.read(1, {});
  EXPECT_EQ(after.number, 65'536U);
  EXPECT_EQ(after.step, Step::next);
  const auto gap = numbers.read(4, {});
  EXPECT_EQ(gap.missing, 2U);
  EXPECT_EQ(numbers.read(3, {}).step, Step::backwards);
  EXPECT_EQ(numbers.read(5, {}).missing, 0U);
}

TEST(FrameNumbers, ids_of_64_bits_are_taken_as_they_are) {
  FrameNumbers numbers;
  EXPECT_EQ(numbers.read(0, {}).number, 0U);
  EXPECT_EQ(numbers.read(1, {}).number, 1U);
  EXPECT_EQ(numbers.read(70'000, {}).missing, 69'998U);
}

TEST(FrameNumbers, the_trigger_counter_shows_triggers_without_a_frame) {
  FrameNumbers numbers;
  numbers.read(1, 10);
  const auto reading = numbers.read(2, 13);
  EXPECT_EQ(reading.number, 13U);
  EXPECT_EQ(reading.missing, 2U);
  // A damaged frame has no counter: its id continues. The next counter is measured from the last one.
  EXPECT_EQ(numbers.read(3, {}).number, 14U);
  EXPECT_EQ(numbers.read(4, 16).number, 16U);
  // Two frames in the wrong order.
  EXPECT_EQ(numbers.read(5, 18).missing, 1U);
  EXPECT_EQ(numbers.read(6, 17).step, Step::backwards);
  EXPECT_EQ(numbers.read(7, 19).missing, 0U);
}

TEST(FrameNumbers, a_number_that_was_left_out_is_found_once) {
  FrameNumbers numbers;
  numbers.read(1, 1);
  EXPECT_EQ(numbers.read(2, 4).missing, 2U);
  EXPECT_TRUE(numbers.read(3, 2).found);
  EXPECT_TRUE(numbers.read(4, 3).found);
  EXPECT_FALSE(numbers.read(5, 3).found);
  EXPECT_FALSE(numbers.read(6, 5).found);
}

TEST(FrameNumbers, a_stream_that_begins_anew_leaves_a_gap) {
  FrameNumbers numbers;
  numbers.read(500, {});
  numbers.restart();
  EXPECT_GT(numbers.read(0, {}).number, 501U);
}

}  // namespace
}  // namespace symrig::frame_numbers_test
