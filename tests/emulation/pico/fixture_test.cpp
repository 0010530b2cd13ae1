// SPDX-License-Identifier: Apache-2.0
// The production test on the emulated Pico with its plug: every wire, an interlock, and the watchdog starved
// on purpose.
#include "symrig/board/fixture_test.hpp"

#include "emulated_pico.hpp"

#include <cstdio>

#include <gtest/gtest.h>

namespace symrig::test::pico_fixture_test {
namespace {

using namespace std::chrono_literals;

TEST(EmulatedPico, passes_the_production_test_with_its_plug) {
  NEEDS_EMULATION();
  EmulatedPico pico;
  Board board = pico.connect();
  const std::vector<Jumper> plug = default_plug(board.info());
  ASSERT_EQ(plug.size(), 6U);
  for (const Jumper& wire : plug)
    ASSERT_OK(pico.bench().jumper(static_cast<std::uint8_t>(gpio_of(board.info(), wire.output)),
                                  static_cast<std::uint8_t>(gpio_of(board.info(), wire.input))));
  SelfTestOptions options;
  options.pings = 3;
  const auto test = fixture_test(board, plug, options);
  ASSERT_OK(test);
  for (const SelfCheck& check : test->basics.checks) EXPECT_TRUE(check.passed) << check.text;
  ASSERT_EQ(test->wires.size(), 6U);
  for (const WireTest& wire : test->wires) EXPECT_TRUE(wire.passed) << wire.text;
  EXPECT_TRUE(test->crossing.passed) << test->crossing.text;
  EXPECT_TRUE(test->trip.passed) << test->trip.text;
  EXPECT_TRUE(test->watchdog.passed) << test->watchdog.text;
  ASSERT_TRUE(test->watchdog.answered);
  const Nanoseconds answered = board.info().rate.nanoseconds(*test->watchdog.answered);
  EXPECT_GE(answered, 350ms);
  EXPECT_LE(answered, 410ms);
  // The board is as good as new: the self-test objects to a start by the watchdog.
  const auto again = self_test(board, options);
  ASSERT_OK(again);
  EXPECT_TRUE(again->passed());
  std::printf("trip: %s\nwatchdog: %s\n", test->trip.text.c_str(), test->watchdog.text.c_str());
}

}  // namespace
}  // namespace symrig::test::pico_fixture_test
