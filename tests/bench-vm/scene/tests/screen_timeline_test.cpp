// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/screen_timeline.hpp"

#include <utility>

#include <gtest/gtest.h>

namespace symrig::bench_vm::screen_timeline_test {
namespace {

using namespace std::chrono_literals;

Picture picture(float value) {
  return std::make_shared<const Image<float>>(Grid{2, 2}, 1, value);
}

using Shares = std::vector<std::pair<std::uint64_t, double>>;
Shares shares(const ScreenTimeline& timeline, Nanoseconds begin, Nanoseconds end) {
  Shares all;
  for (const auto& lit : timeline.during(begin, end)) all.emplace_back(lit.number, lit.share);
  return all;
}

ScreenTimeline three() {
  ScreenTimeline timeline;
  EXPECT_TRUE(timeline.change(10ms, picture(0)));
  EXPECT_TRUE(timeline.change(20ms, picture(1)));
  EXPECT_TRUE(timeline.change(40ms, picture(0.5F)));
  return timeline;
}

TEST(ScreenTimeline, mixes_pictures_by_their_share_of_the_time) {
  const ScreenTimeline timeline = three();
  EXPECT_EQ(shares(timeline, 22ms, 38ms), (Shares{{1, 1.0}}));
  EXPECT_EQ(shares(timeline, 20ms, 40ms), (Shares{{1, 1.0}}));  // the end does not count
  EXPECT_EQ(shares(timeline, 15ms, 55ms), (Shares{{0, 0.125}, {1, 0.5}, {2, 0.375}}));
  EXPECT_EQ(shares(timeline, 5ms, 15ms), (Shares{{0, 0.5}}));  // before the first picture there is no light
  EXPECT_EQ(shares(timeline, 1ms, 9ms), (Shares{}));
  EXPECT_EQ(shares(timeline, 50ms, 90ms), (Shares{{2, 1.0}}));
}

TEST(ScreenTimeline, takes_the_same_picture_for_no_change) {
  ScreenTimeline timeline;
  EXPECT_FALSE(timeline.change(1ms, nullptr));
  EXPECT_TRUE(timeline.change(10ms, picture(1)));
  EXPECT_FALSE(timeline.change(20ms, picture(1)));  // other memory, same values
  EXPECT_EQ(shares(timeline, 15ms, 25ms), (Shares{{0, 1.0}}));
}

TEST(ScreenTimeline, is_dark_while_the_screen_is_off) {
  ScreenTimeline timeline = three();
  EXPECT_TRUE(timeline.change(60ms, nullptr));
  EXPECT_FALSE(timeline.change(65ms, nullptr));
  EXPECT_TRUE(timeline.change(80ms, picture(0.5F)));  // the same picture again, after none
  EXPECT_EQ(shares(timeline, 50ms, 90ms), (Shares{{2, 0.25}, {3, 0.25}}));
  EXPECT_EQ(timeline.newest().number, 3U);
}

TEST(ScreenTimeline, forgets_only_what_was_gone) {
  ScreenTimeline timeline = three();
  const Shares before = shares(timeline, 30ms, 50ms);
  timeline.forget_before(30ms);
  EXPECT_EQ(shares(timeline, 30ms, 50ms), before);
  EXPECT_EQ(shares(timeline, 15ms, 25ms), (Shares{{1, 0.5}}));  // the first picture is forgotten
  timeline.forget_before(100ms);
  EXPECT_EQ(shares(timeline, 110ms, 120ms), (Shares{{2, 1.0}}));
}

}  // namespace
}  // namespace symrig::bench_vm::screen_timeline_test
