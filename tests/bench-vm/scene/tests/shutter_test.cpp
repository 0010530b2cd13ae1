// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/shutter.hpp"

#include <gtest/gtest.h>

namespace symrig::bench_vm::shutter_test {
namespace {

using namespace std::chrono_literals;
using Move = Shutter::Move;

TEST(Shutter, is_open_while_the_trigger_is_high) {
  Shutter shutter(3ms);
  EXPECT_EQ(shutter.trigger(false, 1ms), Move::none);  // it was low
  EXPECT_EQ(shutter.trigger(true, 2ms), Move::open);
  EXPECT_EQ(shutter.trigger(true, 3ms), Move::none);  // the same level set again
  EXPECT_TRUE(shutter.is_open());
  EXPECT_EQ(shutter.trigger(false, 5ms), Move::close);
  EXPECT_FALSE(shutter.is_open());
  EXPECT_EQ(shutter.trigger(true, 8ms), Move::open);  // exactly at the end of the readout
}

TEST(Shutter, misses_a_trigger_during_readout_and_its_end) {
  Shutter shutter(3ms);
  shutter.trigger(true, 2ms);
  shutter.trigger(false, 5ms);
  EXPECT_EQ(shutter.trigger(true, 7'999'999ns), Move::none);
  EXPECT_EQ(shutter.trigger(false, 20ms), Move::none);  // late enough, but it never opened
  EXPECT_EQ(shutter.missed(), 1U);
  EXPECT_EQ(shutter.trigger(true, 21ms), Move::open);
}

TEST(Shutter, stays_closed_for_a_trigger_that_the_camera_does_not_see) {
  Shutter shutter(3ms);
  EXPECT_EQ(shutter.trigger(true, 2ms, false), Move::none);
  EXPECT_EQ(shutter.trigger(true, 3ms), Move::none);  // the same level set again
  EXPECT_EQ(shutter.trigger(false, 5ms), Move::none);
  EXPECT_EQ(shutter.trigger(true, 6ms), Move::open);           // there is nothing to read out
  EXPECT_EQ(shutter.trigger(false, 7ms, false), Move::close);  // only a rising edge can be overlooked
  EXPECT_EQ(shutter.triggers(), 2U);
  EXPECT_EQ(shutter.unseen(), 1U);
  EXPECT_EQ(shutter.missed(), 0U);
}

}  // namespace
}  // namespace symrig::bench_vm::shutter_test
