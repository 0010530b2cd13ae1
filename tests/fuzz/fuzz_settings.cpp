// SPDX-License-Identifier: Apache-2.0
// Whatever the board's flash holds, what comes out of it fits the board.
#include "symrig/firmware/stored_config.hpp"
#include "symrig/protocol/crc32c.hpp"
#include "targets.hpp"
#include "unit/firmware/settings_in_memory.hpp"

#include <array>
#include <cstring>
#include <vector>

namespace symrig::fuzz {
namespace {

constexpr std::array<hal::Line, 6> kLines{{{"a", "", true, 0, false, 1},
                                           {"b", "", true, 0, false, 1},
                                           {"c", "", true, 0, false, 1},
                                           {"d", "", false, 7, true, 1},
                                           {"e", "", false, 7, true, 1},
                                           {"f", "", false, 7, true, 1}}};

using Flash = test::SettingsInMemory;

hal::BoardTraits traits() {
  hal::BoardTraits board;
  board.lines = kLines.data();
  board.line_count = static_cast<std::uint8_t>(kLines.size());
  return board;
}

void expect_sound(Flash& flash) {
  protocol::BoardConfig config;
  firmware::Label label;
  if (!load_config(flash, traits(), config, label)) return;
  require(std::memchr(label.text, 0, sizeof label.text) != nullptr, "a label ends");
  for (unsigned k = 0; k < protocol::kMaxLines; ++k) {
    const protocol::LineConfig& line = config.lines[k];
    if (!line.configured) continue;
    require(k < kLines.size() && line.output == kLines.at(k).output, "a stored line is the board's");
  }
  require((config.safe_levels() & ~7U) == 0, "only outputs have safe levels");
  require(save_config(flash, config, label), "what was loaded can be stored");
  protocol::BoardConfig again;
  firmware::Label same;
  require(load_config(flash, traits(), again, same), "what was stored can be loaded");
  require(protocol::config_hash(again) == protocol::config_hash(config), "and is the same configuration");
  require(std::strcmp(same.text, label.text) == 0, "with the same label");
}

}  // namespace

void fuzz_settings(const std::uint8_t* data, std::size_t size) {
  Flash flash;
  flash.bytes.assign(data, data + size);
  expect_sound(flash);
  // The same with a sum that fits, as a record written by other firmware would have.
  flash.bytes.assign(data, data + size);
  std::array<std::uint8_t, 4> sum{};
  protocol::put_u32(sum.data(), protocol::crc32c({data, size}));
  flash.bytes.insert(flash.bytes.end(), sum.begin(), sum.end());
  expect_sound(flash);
}

}  // namespace symrig::fuzz
