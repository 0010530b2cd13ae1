// SPDX-License-Identifier: Apache-2.0
#include "symrig/board/ticks.hpp"

#include <cstdint>

#include <gtest/gtest.h>
#include <rapidcheck.h>

namespace symrig::ticks_test {
namespace {

using namespace std::chrono_literals;

TEST(Ticks, known_conversions) {
  const TickRate rate{125'000'000};
  EXPECT_EQ(rate.ticks(8ns).count, 1U);
  EXPECT_EQ(rate.ticks(1s).count, 125'000'000U);
  EXPECT_EQ(rate.ticks(4ns).count, 1U);  // half a tick goes up
  EXPECT_EQ(rate.ticks(3ns).count, 0U);
  EXPECT_EQ(rate.nanoseconds(Ticks{125}), 1us);
  EXPECT_EQ(TickRate{12'000'000}.nanoseconds(Ticks{1}), 83ns);
  // ten years at 8 ns
  EXPECT_EQ(rate.ticks(std::chrono::hours(24 * 3650)).count, 39'420'000'000'000'000U);
}

TEST(Ticks, round_trip_is_within_half_a_step) {
  EXPECT_TRUE(rc::check([] {
    const TickRate rate{*rc::gen::inRange<std::uint64_t>(1'000, 1'000'000'000)};
    const Nanoseconds t{*rc::gen::inRange<std::int64_t>(0, 1'000'000'000'000'000'000)};
    const auto back = rate.nanoseconds(rate.ticks(t));
    // |t - ticks / hz| <= half a tick, and half a nanosecond of the way back; at most one for integers.
    const auto bound = static_cast<std::int64_t>(500'000'000 / rate.hz + 1);
    RC_ASSERT(std::abs((back - t).count()) <= bound);
  }));
}

}  // namespace
}  // namespace symrig::ticks_test
