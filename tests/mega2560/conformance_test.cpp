// SPDX-License-Identifier: Apache-2.0
// The whole conformance kit over the UART, with the wire that some checks ask for.
#include "symrig/conformance/conformance.hpp"

#include "assert_ok.hpp"
#include "emulated_mega.hpp"

#include <cstdio>

#include <gtest/gtest.h>

namespace symrig::test::mega_conformance_test {
namespace {

constexpr unsigned kAux0 = 4;
constexpr unsigned kStackKept = 96;  // bytes that no test has reached

TEST(EmulatedMega, passes_the_conformance_kit_with_a_wire) {
  NEEDS_MEGA();
  EmulatedMega mega;
  mega.jumper(kAux0, 9);
  ConformanceOptions options;
  options.jumper = Jumper{"aux0", "interlock"};
  options.on_result = [](const CheckResult& result) {
    EXPECT_NE(result.outcome, CheckOutcome::failed) << result.name << ": " << result.detail;
  };
  const auto report = check_conformance(mega.link(), options);
  ASSERT_OK(report);
  // No room for three chunks of a program, and no edge that the board cannot wait for.
  EXPECT_EQ(report->count(CheckOutcome::skipped), 2U);
  EXPECT_GE(mega.stack_left(), kStackKept);
  std::printf("%zu passed, %zu failed, %zu skipped; %u of %u bytes of stack never used\n",
              report->count(CheckOutcome::passed), report->count(CheckOutcome::failed),
              report->count(CheckOutcome::skipped), mega.stack_left(), mega.stack_room());
}

}  // namespace
}  // namespace symrig::test::mega_conformance_test
