// SPDX-License-Identifier: Apache-2.0
// Levels by hand, and who must be there while they stand: the host-loss policy of benign, lamp and laser
// lines.
#include "raw_host.hpp"
#include "unit/protocol/random_program.hpp"

#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::firmware::by_hand_test {
namespace {

using test::RawHost;

constexpr std::uint64_t kMs = 125'000;  // ticks
constexpr std::uint32_t kLamp = 4;      // line 2

protocol::BoardConfig config_of(std::uint8_t hazard, std::uint64_t max_on = 0) {
  protocol::BoardConfig config = test::plain_config();
  config.lines[2].hazard = hazard;
  config.lines[2].max_on = max_on;
  return config;
}

std::vector<std::uint8_t> long_program(std::uint32_t levels, std::uint32_t ticks) {
  std::vector<std::uint8_t> bytes;
  test::pack(protocol::make_record(protocol::Op::set_word, levels, ticks), bytes);
  test::pack(protocol::make_record(protocol::Op::end, 0, 0), bytes);
  return bytes;
}

struct Bench {
  board_sim::SimBoard board;
  RawHost host{board};

  explicit Bench(const protocol::BoardConfig& config) {
    host.hello();
    EXPECT_EQ(host.configure(config), 0U);
  }
  std::uint32_t levels() const { return board.levels() & 7U; }
};

TEST(ByHand, sets_what_the_mask_names_and_nothing_else) {
  Bench bench(config_of(0));
  EXPECT_EQ(bench.host.set_by_hand(3, 3), 0U);
  EXPECT_EQ(bench.levels(), 3U);
  EXPECT_EQ(bench.host.set_by_hand(1, 0), 0U);
  EXPECT_EQ(bench.levels(), 2U);
  EXPECT_EQ(bench.host.set_by_hand(8, 8), symrig_wire_Code_CODE_WRONG_DIRECTION);  // an input
  EXPECT_EQ(bench.host.set_by_hand(1U << 20U, 0), symrig_wire_Code_CODE_WRONG_DIRECTION);
  EXPECT_EQ(bench.levels(), 2U);
  bench.host.abort();
  EXPECT_EQ(bench.levels(), 0U);
}

TEST(ByHand, not_before_lines_are_configured_and_not_in_a_run) {
  board_sim::SimBoard board;
  RawHost host(board);
  host.hello();
  EXPECT_EQ(host.set_by_hand(1, 1), symrig_wire_Code_CODE_BAD_STATE);
  ASSERT_EQ(host.configure(config_of(0)), 0U);
  ASSERT_EQ(host.upload(long_program(1, 1000)), 0U);
  ASSERT_EQ(host.arm(), 0U);
  EXPECT_EQ(host.set_by_hand(1, 1), symrig_wire_Code_CODE_BAD_STATE);
}

TEST(ByHand, a_lamp_needs_the_keep_alive_and_goes_off_without_it) {
  Bench bench(config_of(symrig_wire_Hazard_HAZARD_LAMP));
  EXPECT_EQ(bench.host.set_by_hand(kLamp, kLamp), symrig_wire_Code_CODE_KEEP_ALIVE_NEEDED);
  EXPECT_EQ(bench.host.set_by_hand(3, 3), 0U);  // the benign lines need none
  ASSERT_EQ(bench.host.keep_alive(100), 0U);
  ASSERT_EQ(bench.host.set_by_hand(kLamp, kLamp), 0U);
  EXPECT_EQ(bench.host.keep_alive(0), symrig_wire_Code_CODE_KEEP_ALIVE_NEEDED);  // not while it is on
  const std::uint64_t last = bench.board.now();
  bench.board.advance_to(last + 100 * kMs - 1);
  EXPECT_EQ(bench.levels(), 7U);
  bench.board.advance_to(last + 100 * kMs);
  EXPECT_EQ(bench.levels(), 0U);
  EXPECT_EQ(bench.host.status().fault.code, symrig_wire_FaultCode_FAULT_KEEP_ALIVE);
}

TEST(ByHand, a_pulled_cable_turns_it_off) {
  Bench bench(config_of(0));
  ASSERT_EQ(bench.host.set_by_hand(1, 1), 0U);
  bench.board.set_attached(false);
  bench.board.advance();
  EXPECT_EQ(bench.levels(), 0U);
}

TEST(ByHand, the_guard_watches_it) {
  Bench bench(config_of(symrig_wire_Hazard_HAZARD_LAMP, 10 * kMs));
  ASSERT_EQ(bench.host.keep_alive(1000), 0U);
  ASSERT_EQ(bench.host.set_by_hand(kLamp, kLamp), 0U);
  bench.board.advance_to(bench.board.now() + 11 * kMs);
  EXPECT_EQ(bench.levels(), 0U);
  EXPECT_EQ(bench.host.status().fault.code, symrig_wire_FaultCode_FAULT_MAX_ON);
}

TEST(HostLoss, a_laser_needs_a_short_keep_alive_and_a_limit) {
  board_sim::SimBoard board;
  RawHost host(board);
  host.hello();
  protocol::LineConfig laser = config_of(symrig_wire_Hazard_HAZARD_LASER).lines[2];
  EXPECT_EQ(host.config_line(2, laser), symrig_wire_Code_CODE_BAD_VALUE);
  ASSERT_EQ(host.configure(config_of(symrig_wire_Hazard_HAZARD_LASER, 1000 * kMs)), 0U);
  ASSERT_EQ(host.upload(long_program(kLamp, 1000)), 0U);
  ASSERT_EQ(host.keep_alive(501), 0U);
  EXPECT_EQ(host.arm(), symrig_wire_Code_CODE_KEEP_ALIVE_NEEDED);
  ASSERT_EQ(host.keep_alive(500), 0U);
  ASSERT_EQ(host.arm(), 0U);
  EXPECT_EQ(host.keep_alive(501), symrig_wire_Code_CODE_KEEP_ALIVE_NEEDED);
  EXPECT_EQ(host.state(), symrig_wire_State_STATE_ARMED);
}

TEST(HostLoss, a_benign_run_may_go_on_without_a_host) {
  Bench bench(config_of(0));
  ASSERT_EQ(bench.host.upload(long_program(1, 500 * kMs)), 0U);
  ASSERT_EQ(bench.host.keep_alive(100), 0U);
  ASSERT_EQ(bench.host.arm(true), 0U);
  ASSERT_EQ(bench.host.start(), 0U);
  const std::uint64_t begun = bench.board.now();
  bench.board.set_attached(false);
  bench.board.advance_to(begun + 400 * kMs);
  EXPECT_EQ(bench.levels(), 1U);
  bench.board.advance_to(begun + 600 * kMs);
  bench.board.set_attached(true);
  bench.host.hello();
  EXPECT_EQ(bench.host.state(), symrig_wire_State_STATE_DONE);
}

TEST(HostLoss, without_being_asked_for_a_run_does_not_go_on) {
  Bench bench(config_of(0));
  ASSERT_EQ(bench.host.upload(long_program(1, 500 * kMs)), 0U);
  ASSERT_EQ(bench.host.arm(), 0U);
  ASSERT_EQ(bench.host.start(), 0U);
  bench.board.set_attached(false);
  bench.board.advance();
  EXPECT_EQ(bench.levels(), 0U);
  EXPECT_EQ(bench.board.supervisor_state(), 7);
}

TEST(HostLoss, no_lamp_runs_on_its_own) {
  Bench bench(config_of(symrig_wire_Hazard_HAZARD_LAMP));
  ASSERT_EQ(bench.host.upload(long_program(kLamp, 1000)), 0U);
  ASSERT_EQ(bench.host.keep_alive(1000), 0U);
  EXPECT_EQ(bench.host.arm(true), symrig_wire_Code_CODE_KEEP_ALIVE_NEEDED);
  EXPECT_EQ(bench.host.arm(), 0U);
}

}  // namespace
}  // namespace symrig::firmware::by_hand_test
