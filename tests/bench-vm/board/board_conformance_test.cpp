// SPDX-License-Identifier: Apache-2.0
// The conformance checks against symrigd with the GPIO of a real kernel.
#include "assert_ok.hpp"
#include "daemon_process.hpp"
#include "symrig/conformance/conformance.hpp"

#include <cstdio>
#include <set>

namespace symrig::bench::board_conformance_test {
namespace {

/// Checks that are not possible here: they need a wire that does not exist, or a rule that this board cannot
/// break.
const std::set<std::string> kSkipped{"rules.refill",    "rules.wait_kind", "interlock.short_opening",
                                     "interlock.trips", "jumper.levels",   "jumper.stamps"};

TEST(BoardConformance, PassesEveryCheck) {
  const DaemonProcess daemon;
  const auto uri = DeviceUri::parse("unix:" + daemon.socket());
  ASSERT_OK(uri);
  auto link = open_link(*uri);
  ASSERT_OK(link);
  const auto report = check_conformance(std::move(*link));
  ASSERT_OK(report);
  for (const CheckResult& result : report->results) {
    EXPECT_NE(result.outcome, CheckOutcome::failed) << result.name << ": " << result.detail;
    const bool expected = result.outcome != CheckOutcome::skipped || kSkipped.contains(result.name);
    EXPECT_TRUE(expected) << result.name << ": " << result.detail;
  }
  std::printf("%zu checks passed, %zu skipped\n", report->count(CheckOutcome::passed),
              report->count(CheckOutcome::skipped));
}

}  // namespace
}  // namespace symrig::bench::board_conformance_test
