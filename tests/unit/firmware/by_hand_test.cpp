// SPDX-License-Identifier: Apache-2.0
// Levels by hand, and who must be there while they stand: the host-loss policy of benign, lamp and laser
// lines.
#include "raw_host.hpp"
#include "settings_in_memory.hpp"
#include "symrig/firmware/stored_config.hpp"
#include "unit/protocol/random_program.hpp"

#include <cstdint>
#include <string>
#include <string_view>
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

// What a board keeps over power-off: its configuration's safe levels and its name.

protocol::BoardConfig config_with_a_high_line() {
  protocol::BoardConfig config = test::plain_config();
  config.lines[1].safe_level = true;
  config.lines[2].hazard = 1;
  config.lines[2].max_on = 123'456'789'012;
  config.lines[2].max_duty_permille = 250;
  config.lines[4].capture = true;
  return config;
}

std::uint32_t store(RawHost& host, std::string_view label) {
  symrig_wire_Request request = RawHost::make(symrig_wire_Request_store_config_tag);
  label.copy(request.body.store_config.label, sizeof request.body.store_config.label - 1);
  return host.code(request);
}

std::string label_of(RawHost& host) {
  const auto reply = host.ask(RawHost::make(symrig_wire_Request_capabilities_tag));
  return reply ? reply->body.capabilities.label : "no reply";
}

TEST(StoredConfig, safe_levels_and_name_hold_from_power_up_on) {
  board_sim::SimBoard board;
  RawHost host(board);
  host.hello();
  ASSERT_EQ(host.configure(config_with_a_high_line()), 0U);
  ASSERT_EQ(store(host, "left rig"), 0U);
  EXPECT_EQ(host.status().stored_config, host.config_hash);
  board.reboot();
  EXPECT_EQ(board.levels() & 7U, 2U);
  host.hello();
  EXPECT_EQ(host.state(), symrig_wire_State_STATE_SAFE);
  EXPECT_EQ(label_of(host), "left rig");
  EXPECT_EQ(host.status().stored_config, host.config_hash);
  host.abort();
  EXPECT_EQ(board.levels() & 7U, 2U);
}

TEST(StoredConfig, without_it_all_lines_start_low) {
  board_sim::SimBoard board;
  RawHost host(board);
  host.hello();
  ASSERT_EQ(host.configure(config_with_a_high_line()), 0U);
  board.reboot();
  host.hello();
  EXPECT_EQ(board.levels() & 7U, 0U);
  EXPECT_EQ(label_of(host), "");
  EXPECT_EQ(host.status().stored_config, 0U);
}

TEST(StoredConfig, only_with_lines_configured_and_at_rest) {
  board_sim::SimBoard board;
  RawHost host(board);
  host.hello();
  EXPECT_EQ(store(host, "x"), symrig_wire_Code_CODE_BAD_STATE);
  ASSERT_EQ(host.configure(test::plain_config()), 0U);
  ASSERT_EQ(host.set_by_hand(1, 1), 0U);
  EXPECT_EQ(store(host, "x"), symrig_wire_Code_CODE_BAD_STATE);
  ASSERT_EQ(host.set_by_hand(1, 0), 0U);
  EXPECT_EQ(store(host, "x"), 0U);
}

TEST(StoredConfig, a_memory_that_takes_nothing_is_told) {
  board_sim::SimBoard board;
  RawHost host(board);
  host.hello();
  ASSERT_EQ(host.configure(test::plain_config()), 0U);
  ASSERT_EQ(store(host, "old"), 0U);
  board.break_settings();
  EXPECT_EQ(store(host, "new"), symrig_wire_Code_CODE_NOT_STORED);
  EXPECT_EQ(label_of(host), "old");
}

const std::vector<hal::Line>& lines() {
  static const std::vector<hal::Line> kLines{{"a", "", true}, {"b", "", true}, {"c", "", true}, {"d"}, {"e"}};
  return kLines;
}

hal::BoardTraits traits() {
  hal::BoardTraits traits;
  traits.lines = lines().data();
  traits.line_count = static_cast<std::uint8_t>(lines().size());
  return traits;
}

TEST(StoredConfig, comes_back_as_it_was_saved) {
  test::SettingsInMemory memory;
  const protocol::BoardConfig saved = config_with_a_high_line();
  Label name;
  std::string_view("a label of 23 bytes, abc").copy(name.text, 23);
  ASSERT_TRUE(save_config(memory, saved, name));
  protocol::BoardConfig loaded;
  Label label;
  ASSERT_TRUE(load_config(memory, traits(), loaded, label));
  EXPECT_EQ(protocol::config_hash(loaded), protocol::config_hash(saved));
  EXPECT_EQ(std::string(label.text), std::string(name.text));
}

TEST(StoredConfig, no_damaged_byte_and_no_cut_record_is_taken) {
  test::SettingsInMemory memory;
  protocol::BoardConfig saved = config_with_a_high_line();
  ASSERT_TRUE(save_config(memory, saved, {}));
  const std::vector<std::uint8_t> whole = memory.bytes;
  protocol::BoardConfig loaded;
  Label label;
  for (std::size_t at = 0; at < whole.size(); ++at) {
    memory.bytes = whole;
    memory.bytes[at] ^= 0x10;
    EXPECT_FALSE(load_config(memory, traits(), loaded, label)) << at;
    memory.bytes.assign(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(at));
    EXPECT_FALSE(load_config(memory, traits(), loaded, label)) << at;
  }
}

TEST(StoredConfig, a_record_for_another_board_is_not_taken) {
  test::SettingsInMemory memory;
  protocol::BoardConfig saved = config_with_a_high_line();
  ASSERT_TRUE(save_config(memory, saved, {}));
  protocol::BoardConfig loaded;
  Label label;
  hal::BoardTraits fewer = traits();
  fewer.line_count = 3;
  EXPECT_FALSE(load_config(memory, fewer, loaded, label));
  saved.lines[3].output = true;  // an input here
  ASSERT_TRUE(save_config(memory, saved, {}));
  EXPECT_FALSE(load_config(memory, traits(), loaded, label));
}

}  // namespace
}  // namespace symrig::firmware::by_hand_test
