// SPDX-License-Identifier: Apache-2.0
// The input is a list of moves, a byte for the kind and some for the rest.
#include "targets.hpp"
#include "unit/firmware/raw_host.hpp"
#include "unit/protocol/random_program.hpp"

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace symrig::fuzz {
namespace {

constexpr std::uint64_t kMaxOn = 1000;  // of the lamp, ticks
constexpr std::uint32_t kLamp = 4;
constexpr std::uint32_t kOutputs = 7;
constexpr int kMostEvents = 3000;  // of the board, a move

/// Sees that the lamp keeps to its limit: the guard may be one tick late.
class LampWatch final : public boards::Peripheral {
 public:
  void outputs_changed(std::uint64_t tick, std::uint32_t levels, boards::SimBoard&) override {
    const bool on = (levels & kLamp) != 0;
    if (on_ && !on) require(tick - since_ <= kMaxOn + 1, "a lamp never outlives its limit");
    if (on && !on_) since_ = tick;
    on_ = on;
  }
  std::uint64_t next_event() const override { return boards::kNever; }
  void on_event(std::uint64_t, boards::SimBoard&) override {}

 private:
  bool on_ = false;
  std::uint64_t since_ = 0;
};

class Player {
 public:
  explicit Player(std::span<const std::uint8_t> input) : input_(input) {
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
    config.lines[2].capture = true;
    require(host_.configure(config) == 0, "the configuration is sound");
  }

  std::uint8_t byte() {
    if (input_.empty()) return 0;
    const std::uint8_t value = input_.front();
    input_ = input_.subspan(1);
    return value;
  }
  std::vector<std::uint8_t> bytes(std::size_t count) {
    const auto part = input_.first(std::min(count, input_.size()));
    input_ = input_.subspan(part.size());
    return {part.begin(), part.end()};
  }

  void move() {
    switch (byte() % 12) {
      case 0:
        board_.write(bytes(byte()));
        break;
      case 1:
        request(bytes(byte() % 48));
        break;
      case 2:
        host_.chunk(byte() % 2 + 1U, byte() * 8U, bytes(byte()));
        break;
      case 3:
        advance(std::uint64_t{1} << byte() % 24U);
        break;
      case 4:
        board_.set_input(3 + byte() % 2, byte() % 2 != 0);
        break;
      case 5:
        host_.upload(program());
        break;
      case 6:
        host_.keep_alive(byte());
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
      default:
        advance(byte());
        break;
    }
    host_.listen();
  }

  /// Anything but a new configuration, which would change the lamp's limit under the watch.
  void request(const std::vector<std::uint8_t>& body) {
    symrig_wire_Request request;
    if (protocol::decode({body.data(), body.size()}, request) &&
        (request.which_body == symrig_wire_Request_config_line_tag))
      return;
    host_.ask_bytes(body);
  }

  /// Records of two bytes each, so that sound programs are common.
  std::vector<std::uint8_t> program() {
    std::vector<std::uint8_t> out;
    const std::size_t records = byte() % 16;
    for (std::size_t i = 0; i < records; ++i) {
      const std::uint8_t a = byte();
      const std::uint8_t b = byte();
      switch (a >> 5U) {
        case 0:
          test::pack(protocol::make_loop(b % 20U), out);
          break;
        case 1:
          test::pack(protocol::make_record(protocol::Op::end_loop, 0, 0), out);
          break;
        case 2:
          test::pack(protocol::make_record(protocol::Op::mark, b, 0), out);
          break;
        case 3:
          test::pack(protocol::make_wait({3, protocol::WaitFor::both, (a & 1U) != 0}, b * 8U), out);
          break;
        default:
          test::pack(protocol::make_record(protocol::Op::set_word, a & kOutputs, b * 4U), out);
          break;
      }
    }
    test::pack(protocol::make_record(protocol::Op::end, byte() & 3U, 0), out);
    return out;
  }

  /// What goes wrong around a board.
  void odd() {
    const std::uint8_t what = byte();
    if (what % 4 == 0) board_.set_attached(what % 8 != 0);
    if (what % 4 == 1) host_.abort();
    if (what % 4 == 2) board_.reboot();
    if (what % 4 == 3) host_.clear_fault(what / 4U % 9);
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
    const bool must_be_safe = state == symrig_wire_State_STATE_FAULT || state == symrig_wire_State_STATE_SAFE;
    const bool are_safe = (board_.levels() & kOutputs) == (board_.safe_levels() & kOutputs);
    require(!must_be_safe || are_safe, "SAFE and FAULT mean safe levels");
  }

  void finish() {
    board_.set_attached(true);
    board_.write(std::vector<std::uint8_t>{0});
    host_.abort();
    require((board_.levels() & kOutputs) == (board_.safe_levels() & kOutputs), "an abort makes safe");
    host_.listen();
    require(host_.hello().has_value(), "a session can always begin");
    require(host_.ask(test::RawHost::make(symrig_wire_Request_get_status_tag)).has_value(),
            "status is answered");
  }

  std::span<const std::uint8_t> input_;
  LampWatch watch_;
  boards::SimBoard board_;
  test::RawHost host_{board_};
};

}  // namespace

void fuzz_board(const std::uint8_t* data, std::size_t size) {
  Player({data, size}).play();
}

}  // namespace symrig::fuzz
