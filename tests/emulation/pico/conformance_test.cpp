// SPDX-License-Identifier: Apache-2.0
// The whole conformance kit on the image that users flash, with the wire that each group of checks asks for.
#include "symrig/conformance/conformance.hpp"

#include "emulated_pico.hpp"

#include <cstdio>
#include <string>

#include <gtest/gtest.h>

namespace symrig::test::conformance_test {
namespace {

/// All checks with a wire from aux0 to `input`. skipped: how many may be.
void check_all(const char* input, std::size_t skipped) {
  EmulatedPico pico;
  const BoardInfo info = pico.connect().info();
  const auto from = static_cast<std::uint8_t>(gpio_of(info, "aux0"));
  const auto to = static_cast<std::uint8_t>(gpio_of(info, input));
  ASSERT_OK(pico.bench().jumper(from, to));
  ConformanceOptions options;
  options.jumper = Jumper{"aux0", input};
  options.on_result = [](const CheckResult& result) {
    EXPECT_NE(result.outcome, CheckOutcome::failed) << result.name << ": " << result.detail;
  };
  const auto report = check_conformance(pico.link(), options);
  ASSERT_OK(report);
  EXPECT_EQ(report->count(CheckOutcome::skipped), skipped);
  std::printf("wire to %s: %zu passed, %zu failed, %zu skipped\n", input, report->count(CheckOutcome::passed),
              report->count(CheckOutcome::failed), report->count(CheckOutcome::skipped));
}

TEST(EmulatedPico, passes_the_conformance_kit_with_a_wire_to_a_stamped_input) {
  NEEDS_EMULATION();
  check_all("camera_strobe", 2);  // that input cannot be an interlock
}

TEST(EmulatedPico, passes_the_conformance_kit_with_a_wire_to_the_interlock) {
  NEEDS_EMULATION();
  check_all("interlock", 0);
}

}  // namespace
}  // namespace symrig::test::conformance_test
