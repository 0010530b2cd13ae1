// SPDX-License-Identifier: Apache-2.0
#include "symrig/run/frame_ledger.hpp"

#include <vector>

#include <gtest/gtest.h>

namespace symrig::frame_ledger_test {
namespace {

/// Two photographs of two exposures, marks at 0, 100, 200, 300, 400, 500.
std::vector<StepMark> marks() {
  return {{0, 0, {0}}, {1, 1, {100}}, {2, 2, {200}}, {0, 3, {300}}, {1, 4, {400}}, {2, 5, {500}}};
}

std::vector<FrameStamp> frames_at(const std::vector<std::uint64_t>& ticks) {
  std::vector<FrameStamp> frames;
  frames.reserve(ticks.size());
  for (const std::uint64_t tick : ticks) frames.push_back({frames.size(), {tick}});
  return frames;
}

TEST(FrameLedger, each_frame_finds_its_exposure) {
  const auto ledger = FrameLedger::pair(marks(), frames_at({101, 200, 409, 510}), Ticks{10});
  ASSERT_TRUE(ledger.ok());
  EXPECT_TRUE(ledger->complete());
  ASSERT_EQ(ledger->entries().size(), 4U);
  EXPECT_EQ(ledger->entries()[0].delay.count, 1U);
  EXPECT_EQ(ledger->entries()[2].photograph, 1U);
  EXPECT_EQ(ledger->entries()[2].exposure, 0U);
  EXPECT_EQ(ledger->entries()[2].frame, 2U);
  EXPECT_EQ(ledger->summary(), "4 frames for 4 exposures");
}

TEST(FrameLedger, a_lost_frame_does_not_shift_those_after_it) {
  const auto ledger = FrameLedger::pair(marks(), frames_at({101, 401, 501}), Ticks{10});
  ASSERT_TRUE(ledger.ok());
  EXPECT_EQ(ledger->missing(), 1U);
  EXPECT_FALSE(ledger->entries()[1].frame.has_value());
  EXPECT_EQ(ledger->entries()[2].frame, 1U);
  EXPECT_EQ(ledger->summary(), "3 frames for 4 exposures; 1 missing, the first at photograph 0, exposure 1");
}

TEST(FrameLedger, frames_nobody_asked_for_are_named) {
  const auto ledger = FrameLedger::pair(marks(), frames_at({50, 101, 105, 200, 350, 401, 501}), Ticks{10});
  ASSERT_TRUE(ledger.ok());
  EXPECT_EQ(ledger->missing(), 0U);
  const std::vector<std::size_t> expected{0, 2, 4};  // too early, a second one, too late
  EXPECT_EQ(std::vector<std::size_t>(ledger->unasked().begin(), ledger->unasked().end()), expected);
  EXPECT_FALSE(ledger->complete());
}

TEST(FrameLedger, what_is_out_of_order_is_refused) {
  EXPECT_FALSE(FrameLedger::pair(marks(), frames_at({200, 100}), Ticks{10}).ok());
  std::vector<StepMark> wrong = marks();
  std::swap(wrong[1], wrong[4]);
  EXPECT_FALSE(FrameLedger::pair(wrong, frames_at({101}), Ticks{10}).ok());
}

}  // namespace
}  // namespace symrig::frame_ledger_test
