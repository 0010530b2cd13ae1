// SPDX-License-Identifier: Apache-2.0
// Whatever the board's flash holds, what comes out of it fits the board.
// The input is a list of moves, a byte for the kind and some for the rest.
#include "compact_program.hpp"
#include "symrig/firmware/stored_config.hpp"
#include "symrig/protocol/crc32c.hpp"
#include "targets.hpp"
#include "unit/firmware/raw_host.hpp"
#include "unit/firmware/settings_in_memory.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <span>
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

namespace {

constexpr std::uint64_t kMaxOn = 1000;  // of the lamp, ticks
constexpr std::uint64_t kMinOff = 300;
constexpr std::uint32_t kLamp = 4;
constexpr std::uint32_t kOutputs = 7;
constexpr std::uint32_t kInterlock = 32;
constexpr int kMostEvents = 3000;  // of the board, a move

/// Sees that the lamp keeps to its limits: the guard may be one tick late, and cannot see while the firmware
/// stands still.
class LampWatch final : public board_sim::Peripheral {
 public:
  void outputs_changed(std::uint64_t tick, std::uint32_t levels, board_sim::SimBoard&) override {
    const bool on = (levels & kLamp) != 0;
    if (on_ && !on) require(tick <= std::max(since_ + kMaxOn, blind_until_) + 1, "a lamp keeps to its limit");
    if (on != on_) since_ = tick;
    on_ = on;
  }
  std::uint64_t next_event() const override { return board_sim::kNever; }
  void on_event(std::uint64_t, board_sim::SimBoard&) override {}

  void blind_until(std::uint64_t tick) { blind_until_ = std::max(blind_until_, tick); }
  /// The lamp is not on beyond its limit now.
  bool within(std::uint64_t now) const { return !on_ || now <= std::max(since_ + kMaxOn, blind_until_) + 1; }

 private:
  bool on_ = false;
  std::uint64_t since_ = 0;
  std::uint64_t blind_until_ = 0;
};

class BoardPlayer {
 public:
  explicit BoardPlayer(std::span<const std::uint8_t> input) : input_(input) {
    board_.attach(watch_);
    host_.hello();
    configure();
  }

  void play() {
    while (!input_.empty()) {
      move();
      check();
    }
    finish();
  }

 private:
  void configure() {
    protocol::BoardConfig config = test::plain_config();
    config.lines[1].safe_level = true;
    config.lines[2].hazard = 1;
    config.lines[2].max_on = kMaxOn;
    config.lines[2].min_off = kMinOff;
    config.lines[2].capture = true;
    config.lines[5].configured = true;
    config.lines[5].role = symrig_wire_LineRole_LINE_ROLE_INTERLOCK;
    config.lines[5].trip_level = true;
    require(host_.configure(config) == 0, "the configuration is sound");
  }

  void move() {
    switch (input_.byte() % 15) {
      case 0:
        board_.write(input_.bytes(input_.byte()));
        break;
      case 1:
        request(input_.bytes(input_.byte() % 48U));
        break;
      case 2:
        host_.chunk(input_.byte() % 2 + 1U, input_.byte() * 8U, input_.bytes(input_.byte()));
        break;
      case 3:
        advance(std::uint64_t{1} << input_.byte() % 24U);
        break;
      case 4:
        drive_input();
        break;
      case 5:
        host_.upload(compact_program(input_, input_.byte() % 16U));
        break;
      case 6:
        host_.keep_alive(input_.byte());
        break;
      case 7:
        host_.arm();
        break;
      case 8:
        host_.start();
        break;
      case 9:
        host_.hello();
        break;
      case 10:
        odd();
        break;
      case 12:
        set_by_hand();
        break;
      case 13:
        ask_rarely();
        break;
      case 14:
        start_later();
        break;
      default:
        advance(input_.byte());
        break;
    }
    host_.listen();
  }

  void drive_input() {
    const std::uint8_t what = input_.byte();
    board_.set_input(3 + what % 3, what / 3U % 2 != 0);
  }

  /// Anything but a new configuration, which would change the lamp's limit under the watch.
  void request(const std::vector<std::uint8_t>& body) {
    symrig_wire_Request request;
    if (protocol::decode({body.data(), body.size()}, request) &&
        (request.which_body == symrig_wire_Request_config_line_tag))
      return;
    host_.ask_bytes(body);
  }

  void set_by_hand() {
    symrig_wire_Request request = test::RawHost::make(symrig_wire_Request_manual_set_tag);
    const std::uint8_t what = input_.byte();
    request.body.manual_set = {what % 16U, what / 16U};
    host_.ask(request);
  }

  void start_later() {
    const std::uint64_t at = board_.now() + std::uint64_t{16} * input_.word();
    host_.start_at(at);
  }

  void ask_rarely() {
    symrig_wire_Request request = symrig_wire_Request_init_zero;
    const std::uint8_t what = input_.byte();
    switch (what % 6) {
      case 0:
        request.which_body = symrig_wire_Request_store_config_tag;
        request.body.store_config.label[0] = static_cast<char>('a' + what % 26);
        break;
      case 1:
        request.which_body = symrig_wire_Request_reboot_tag;
        request.body.reboot = {token_, what % 4 == 1, what % 8 == 3};
        break;
      case 2:
        request.which_body = symrig_wire_Request_identify_tag;
        request.body.identify.seconds = what / 6U;
        break;
      case 3:
        request.which_body = symrig_wire_Request_program_verify_tag;
        break;
      case 4:
        request.which_body = symrig_wire_Request_program_line_tag;
        request.body.program_line.line = what / 6U;
        break;
      default:
        configure_anew();
        return;
    }
    host_.ask(request);
  }

  /// The same limits again, where the state allows it (a poll may find a fault first).
  void configure_anew() {
    if (!reachable() || !host_.hello()) return;
    const int state = board_.supervisor_state();
    if (state == symrig_wire_State_STATE_SAFE || state == symrig_wire_State_STATE_LOADED ||
        state == symrig_wire_State_STATE_DONE || state == symrig_wire_State_STATE_CONFIGURED)
      configure();
  }
  bool reachable() const { return attached_ && !board_.in_bootloader() && board_.now() >= stalled_until_; }

  /// What goes wrong around a board.
  void odd() {
    const std::uint8_t what = input_.byte();
    switch (what % 5) {
      case 0:
        attached_ = what % 10 != 0;
        board_.set_attached(attached_);
        break;
      case 1:
        host_.abort();
        break;
      case 2:
        board_.reboot();
        stalled_until_ = 0;
        break;
      case 3:
        host_.clear_fault(what / 5U % 11);
        break;
      default:
        stall(std::uint64_t{1} << (what / 5U % 28U));
        break;
    }
  }

  /// A stuck main loop, until it comes back or the watchdog resets it.
  void stall(std::uint64_t ticks) {
    const std::uint64_t patience = board_.config().tick_hz * board_sim::kSimWatchdogMs / 1000;
    stalled_until_ = board_.now() + std::min(ticks, patience);
    watch_.blind_until(stalled_until_);
    board_.stall_firmware_until(board_.now() + ticks);
  }

  void advance(std::uint64_t ticks) {
    const std::uint64_t deadline = board_.now() + ticks;
    for (int k = 0; k < kMostEvents && board_.next_event() <= deadline; ++k) {
      board_.advance();
      check();
    }
    if (board_.next_event() > deadline) board_.advance_to(deadline);
  }

  void check() const {
    const int state = board_.supervisor_state();
    require(state >= 0 && state <= 7, "there are eight states");
    if (board_.in_bootloader()) return;
    const bool must_be_safe = state == symrig_wire_State_STATE_FAULT || state == symrig_wire_State_STATE_SAFE;
    require(!must_be_safe || safe(), "SAFE and FAULT mean safe levels");
    const bool open = (board_.levels() & kInterlock) != 0;
    require(!open || safe(), "an open interlock means safe levels");
    require(watch_.within(board_.now()), "no lamp is on beyond its limit");
  }
  bool safe() const { return (board_.levels() & kOutputs) == (board_.safe_levels() & kOutputs); }

  void finish() {
    board_.set_attached(true);
    advance(stalled_until_ > board_.now() ? stalled_until_ - board_.now() : 0);
    board_.write(std::vector<std::uint8_t>{0});
    if (board_.in_bootloader()) board_.reboot();
    host_.abort();
    require(safe(), "an abort makes safe");
    host_.listen();
    require(host_.hello().has_value(), "a session can always begin");
    require(host_.ask(test::RawHost::make(symrig_wire_Request_get_status_tag)).has_value(),
            "status is answered");
  }

  static board_sim::SimBoardConfig small() {
    board_sim::SimBoardConfig config;
    config.program_records = 256;
    return config;
  }

  Input input_;
  LampWatch watch_;
  board_sim::SimBoard board_{small()};
  test::RawHost host_{board_};
  bool attached_ = true;
  std::uint64_t stalled_until_ = 0;
  std::uint32_t token_ = protocol::crc32c({reinterpret_cast<const std::uint8_t*>("sim-0001"), 8});
};

}  // namespace

void fuzz_board(const std::uint8_t* data, std::size_t size) {
  BoardPlayer({data, size}).play();
}

}  // namespace symrig::fuzz
