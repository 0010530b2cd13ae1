// SPDX-License-Identifier: Apache-2.0
// The test that each Probe should have: the laws, and a capture.
#include "foreign_probe.hpp"

#include <symrig/acquisition/capture.hpp>
#include <symrig/testing/probe_laws.hpp>

TEST(ForeignProbe, keeps_the_laws) {
  const auto probe = ForeignProbe::open();
  ASSERT_TRUE(probe.ok());
  // The hot pixel sees nothing, so it cannot answer for the light that it sends.
  symrig::expect_probe_laws(**probe, false);
}

TEST(ForeignProbe, is_captured) {
  const auto probe = ForeignProbe::open();
  ASSERT_TRUE(probe.ok());
  const auto captured = symrig::capture(**probe, {});
  ASSERT_TRUE(captured.ok()) << captured.error().line();
  EXPECT_TRUE(captured->noise_check.findings.empty());
}
