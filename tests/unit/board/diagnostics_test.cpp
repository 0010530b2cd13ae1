// SPDX-License-Identifier: Apache-2.0
// What a board has measured about itself, against what it declares.
#include "symrig/board/board.hpp"

#include <gtest/gtest.h>

namespace symrig::diagnostics_test {
namespace {

BoardInfo declared() {
  BoardInfo info;
  info.board = "pico";
  info.poll_ticks = 240'000;
  info.refill_ticks = 450;
  return info;
}

BoardDiagnostics sound() {
  BoardDiagnostics found;
  found.longest_round = 240'000;
  found.worst_refill = 450;
  found.chip_revision = 2;
  return found;
}

TEST(Diagnostics, a_board_within_its_promises_has_no_objections) {
  EXPECT_TRUE(sound().objections(declared()).empty());
  EXPECT_TRUE(BoardDiagnostics().objections(declared()).empty()) << "nothing measured yet";
}

TEST(Diagnostics, each_broken_promise_is_named_with_both_numbers) {
  BoardDiagnostics found = sound();
  found.longest_round = 240'001;
  found.worst_refill = 451;
  found.queue_overflows = 3;
  found.dma_errors = 1;
  const auto objections = found.objections(declared());
  ASSERT_EQ(objections.size(), 4U);
  EXPECT_NE(objections[0].find("240001"), std::string::npos);
  EXPECT_NE(objections[0].find("240000"), std::string::npos);
  EXPECT_NE(objections[1].find("451"), std::string::npos);
  EXPECT_NE(objections[2].find("3 words"), std::string::npos);
  EXPECT_NE(objections[3].find("DMA"), std::string::npos);
}

TEST(Diagnostics, only_a_pico_with_a_chip_older_than_b2_is_warned_of_e5) {
  BoardDiagnostics found = sound();
  found.chip_revision = 1;
  ASSERT_EQ(found.objections(declared()).size(), 1U);
  EXPECT_NE(found.objections(declared())[0].find("RP2040-E5"), std::string::npos);
  BoardInfo other = declared();
  other.board = "other";
  EXPECT_TRUE(found.objections(other).empty());
}

}  // namespace
}  // namespace symrig::diagnostics_test
