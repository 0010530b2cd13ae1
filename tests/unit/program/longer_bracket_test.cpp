// SPDX-License-Identifier: Apache-2.0
#include "program/longer_bracket.hpp"

#include <gtest/gtest.h>

namespace symrig::longer_bracket_test {
namespace {

using namespace std::chrono_literals;
using Bracket = std::vector<Nanoseconds>;

TEST(LongerBracket, raises_the_one_that_is_too_short) {
  EXPECT_EQ(program::longer_bracket({3us, 1ms, 4ms}, 30us), (Bracket{30us, 1ms, 4ms}));
  EXPECT_EQ(program::longer_bracket({1ms, 4ms}, 30us), (Bracket{1ms, 4ms}));
}

// Five exposures of 30 us see no more than one.
TEST(LongerBracket, keeps_its_ratios_where_several_are_too_short) {
  EXPECT_EQ(program::longer_bracket({1us, 2us, 4us, 8us, 16us}, 30us),
            (Bracket{30us, 60us, 120us, 240us, 480us}));
  EXPECT_EQ(program::longer_bracket({4us, 1us, 2us}, 30us), (Bracket{120us, 30us, 60us}));
}

TEST(LongerBracket, whole_refreshes_stay_different) {
  const auto whole = [](Nanoseconds exposure) {
    return std::max<std::int64_t>(1, (exposure + 8ms) / 16ms) * Nanoseconds(16ms);
  };
  EXPECT_EQ(program::longer_bracket({1ms, 2ms, 4ms, 8ms}, 16ms, whole), (Bracket{16ms, 32ms, 64ms, 128ms}));
  EXPECT_EQ(program::longer_bracket({10ms, 40ms}, 16ms, whole), (Bracket{16ms, 48ms}));
}

TEST(LongerBracket, what_was_equal_stands_there_once) {
  EXPECT_EQ(program::longer_bracket({1us, 1us, 1us}, 30us), (Bracket{30us}));
  EXPECT_EQ(program::longer_bracket({0us, 0us, 5us}, 30us), (Bracket{30us, 150ms}));
  EXPECT_EQ(program::longer_bracket({}, 30us), Bracket{});
}

}  // namespace
}  // namespace symrig::longer_bracket_test
