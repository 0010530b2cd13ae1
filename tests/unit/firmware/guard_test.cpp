// SPDX-License-Identifier: Apache-2.0
#include "symrig/firmware/guard.hpp"

#include <gtest/gtest.h>

namespace symrig::firmware::guard_test {
namespace {

using protocol::Rule;

protocol::BoardConfig lamp_on_line(unsigned line, std::uint64_t max_on, std::uint64_t min_off,
                                   std::uint16_t duty, bool safe_level = false) {
  protocol::BoardConfig config;
  config.lines[line] = {true, true, 3, 1, safe_level, false, max_on, min_off, duty};
  return config;
}

TEST(Guard, trips_one_tick_after_max_on) {
  Guard guard;
  guard.configure(lamp_on_line(2, 100, 0, 0), 0, 0);
  Breach breach;
  EXPECT_EQ(guard.next_deadline(), hal::kNever);
  EXPECT_FALSE(guard.edge({1000, 2, true}, breach));
  EXPECT_EQ(guard.next_deadline(), 1101U);
  EXPECT_FALSE(guard.check(1100, breach));
  ASSERT_TRUE(guard.check(1101, breach));
  EXPECT_EQ(breach.rule, Rule::max_on);
  EXPECT_EQ(breach.line, 2);
  EXPECT_EQ(breach.tick, 1101U);
}

TEST(Guard, a_pulse_seen_late_is_still_judged) {
  Guard guard;
  guard.configure(lamp_on_line(0, 100, 0, 0), 0, 0);
  Breach breach;
  guard.edge({0, 0, true}, breach);
  EXPECT_TRUE(guard.edge({101, 0, false}, breach));
  EXPECT_EQ(breach.rule, Rule::max_on);
}

TEST(Guard, on_is_away_from_the_safe_level) {
  Guard guard;
  guard.configure(lamp_on_line(1, 100, 0, 0, true), 2, 0);
  Breach breach;
  EXPECT_FALSE(guard.edge({10, 1, false}, breach));
  EXPECT_EQ(guard.next_deadline(), 111U);
  EXPECT_FALSE(guard.edge({110, 1, true}, breach));
  EXPECT_EQ(guard.next_deadline(), hal::kNever);
}

TEST(Guard, rests_are_judged_when_the_line_comes_on_again) {
  Guard guard;
  guard.configure(lamp_on_line(0, 0, 50, 0), 0, 0);
  Breach breach;
  EXPECT_FALSE(guard.edge({5, 0, true}, breach));  // rested for ever before
  EXPECT_FALSE(guard.edge({10, 0, false}, breach));
  EXPECT_FALSE(guard.edge({60, 0, true}, breach));
  EXPECT_FALSE(guard.edge({70, 0, false}, breach));
  ASSERT_TRUE(guard.edge({119, 0, true}, breach));
  EXPECT_EQ(breach.rule, Rule::min_off);
}

TEST(Guard, duty_and_what_is_still_missing_of_a_rest) {
  Guard guard;
  guard.configure(lamp_on_line(0, 0, 0, 250), 0, 0);
  Breach breach;
  guard.edge({1000, 0, true}, breach);
  guard.edge({1100, 0, false}, breach);  // 100 on: 300 of rest
  hal::Tick needed = 0;
  EXPECT_EQ(guard.cooling_line(protocol::kOutputMask, 1399, needed), 0);
  EXPECT_EQ(needed, 1U);
  EXPECT_EQ(guard.cooling_line(protocol::kOutputMask, 1400, needed), -1);
  ASSERT_TRUE(guard.edge({1399, 0, true}, breach));
  EXPECT_EQ(breach.rule, Rule::duty);
}

TEST(Guard, a_new_configuration_does_not_make_a_hot_lamp_cold) {
  Guard guard;
  guard.configure(lamp_on_line(0, 0, 1000, 0), 0, 0);
  Breach breach;
  guard.edge({10, 0, true}, breach);
  guard.edge({20, 0, false}, breach);
  guard.configure(lamp_on_line(0, 0, 1000, 0), 0, 30);
  hal::Tick needed = 0;
  EXPECT_EQ(guard.cooling_line(protocol::kOutputMask, 30, needed), 0);
  EXPECT_TRUE(guard.edge({100, 0, true}, breach));
}

TEST(Guard, lines_without_limits_are_not_watched) {
  Guard guard;
  protocol::BoardConfig config;
  config.lines[0] = {true, true, 0, 0, false, false, 0, 0, 0};
  guard.configure(config, 0, 0);
  Breach breach;
  EXPECT_FALSE(guard.watching());
  EXPECT_FALSE(guard.edge({10, 0, true}, breach));
  EXPECT_FALSE(guard.edge({10, 31, true}, breach));
}

}  // namespace
}  // namespace symrig::firmware::guard_test
