// SPDX-License-Identifier: Apache-2.0
// What a board keeps over power-off: its configuration's safe levels and its name.
#include "symrig/firmware/stored_config.hpp"

#include "raw_host.hpp"
#include "settings_in_memory.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::firmware::stored_config_test {
namespace {

using test::RawHost;

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
}  // namespace symrig::firmware::stored_config_test
