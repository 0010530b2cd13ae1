// SPDX-License-Identifier: Apache-2.0
#include "symrig/boards/sim_board.hpp"

#include "engine.hpp"
#include "symrig/firmware/core.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <deque>
#include <optional>
#include <utility>

namespace symrig::boards {
namespace {

constexpr std::size_t kLinkRoom = std::size_t{1} << 16U;  // bytes to the host not yet read
constexpr std::size_t kCaptureDepth = 4096;
constexpr std::size_t kEvents = 1024;
constexpr std::array<std::uint8_t, 8> kUniqueId{'s', 'i', 'm', '-', '0', '0', '0', '1'};

/// Time-stamped changes of the pins.
class SimCapture final : public hal::Capture {
 public:
  std::uint32_t levels() const override { return levels_; }
  bool pop(hal::CapturedEdge& edge) override {
    if (edges_.empty()) return false;
    edge = edges_.front();
    edges_.pop_front();
    return true;
  }
  bool take_overflow() override { return std::exchange(overflow_, false); }

  /// Sets the lines in `mask` to `levels`. Returns whether any changed.
  bool set(std::uint32_t mask, std::uint32_t levels, std::uint64_t tick) {
    std::uint32_t changed = (levels_ ^ levels) & mask;
    if (changed == 0) return false;
    levels_ ^= changed;
    for (; changed != 0; changed &= changed - 1) {
      const auto line = static_cast<std::uint8_t>(std::countr_zero(changed));
      add({tick, line, ((levels_ >> line) & 1U) != 0});
    }
    return true;
  }
  bool pending() const { return !edges_.empty(); }

 private:
  void add(const hal::CapturedEdge& edge) {
    if (edges_.size() < kCaptureDepth) {
      edges_.push_back(edge);
    } else {
      overflow_ = true;
    }
  }

  std::deque<hal::CapturedEdge> edges_;
  std::uint32_t levels_ = 0;
  bool overflow_ = false;
};

class SimByteLink final : public hal::ByteLink {
 public:
  std::size_t read(std::uint8_t* out, std::size_t room) override {
    const std::size_t count = std::min(room, to_board_.size() - taken_);
    std::copy_n(to_board_.begin() + static_cast<std::ptrdiff_t>(taken_), count, out);
    taken_ += count;
    if (taken_ == to_board_.size()) {
      to_board_.clear();
      taken_ = 0;
    }
    return count;
  }
  std::size_t room() const override { return attached_ ? kLinkRoom - to_host_.size() : 0; }
  void write(const std::uint8_t* bytes, std::size_t size) override {
    to_host_.insert(to_host_.end(), bytes, bytes + size);
  }
  bool attached() const override { return attached_; }

  void from_host(std::span<const std::uint8_t> bytes) {
    if (attached_) to_board_.insert(to_board_.end(), bytes.begin(), bytes.end());
  }
  std::vector<std::uint8_t> take_to_host() { return std::exchange(to_host_, {}); }
  void set_attached(bool attached) { attached_ = attached; }

 private:
  std::vector<std::uint8_t> to_board_;
  std::size_t taken_ = 0;
  std::vector<std::uint8_t> to_host_;
  bool attached_ = true;
};

class SimFaultStore final : public hal::FaultStore {
 public:
  hal::FaultRecord load() const override { return record_; }
  void save(const hal::FaultRecord& record) override { record_ = record; }

 private:
  hal::FaultRecord record_;
};

class SimClock final : public hal::Clock {
 public:
  explicit SimClock(std::uint64_t tick) : tick_(tick) {}
  hal::Tick now() const override { return tick_; }
  void move_to(std::uint64_t tick) { tick_ = std::max(tick, tick_); }

 private:
  std::uint64_t tick_;
};

}  // namespace

std::vector<SimLine> default_sim_lines() {
  return {{"projector_trigger", true},
          {"camera_trigger", true},
          {"lamp_enable", true},
          {"vsync", false},
          {"camera_strobe", false}};
}

struct SimBoard::Impl final : Pins {
  Impl(SimBoard& board, SimBoardConfig settings)
      : self(board),
        config(std::move(settings)),
        clock(config.start_tick),
        engine(*this, std::max<std::uint32_t>(config.engine_segments, 2)),
        program(std::size_t{config.program_records} * protocol::kRecordSize),
        events(kEvents) {
    for (const SimLine& line : config.lines) {
      if (line.output) output_mask |= 1U << lines.size();
      lines.push_back({line.name.c_str(), line.output});
    }
    traits = {"sim",
              kUniqueId.data(),
              static_cast<std::uint8_t>(kUniqueId.size()),
              lines.data(),
              static_cast<std::uint8_t>(lines.size()),
              config.tick_hz,
              config.min_dwell,
              UINT32_MAX,
              config.wait_latency};
    power_up();
  }

  void power_up() {
    engine.force(0);  // pull-downs
    core.emplace(hardware, firmware::Memory{{program.data(), program.size()},
                                            events.data(),
                                            static_cast<std::uint16_t>(events.size())});
    core->boot();
  }

  // Pins
  void drive(std::uint32_t levels) override {
    if (!capture.set(output_mask, levels, clock.now())) return;
    for (Peripheral* peripheral : peripherals)
      peripheral->outputs_changed(clock.now(), capture.levels(), self);
  }
  std::uint64_t now() const override { return clock.now(); }

  std::uint64_t peripherals_next() const {
    std::uint64_t next = kNever;
    for (const Peripheral* peripheral : peripherals) next = std::min(next, peripheral->next_event());
    return next;
  }
  std::uint64_t firmware_next() const {
    const std::uint64_t wanted = wake ? clock.now() : core->next_deadline();
    return wanted == kNever ? kNever : std::max(wanted, stalled_until);
  }
  std::uint64_t next_event() const {
    const std::uint64_t next = std::min({engine.next_event(), peripherals_next(), firmware_next()});
    return next == kNever ? kNever : std::max(next, clock.now());
  }

  /// Everything that is due now, once: hardware first, then what is wired to it, then the firmware.
  void pass() {
    if (engine.next_event() <= clock.now()) {
      engine.step();
      wake = true;
    }
    for (Peripheral* peripheral : peripherals)
      if (peripheral->next_event() <= clock.now()) peripheral->on_event(clock.now(), self);
    wake = wake || capture.pending();
    if (firmware_next() <= clock.now()) run_firmware();
  }

  void run_firmware() {
    if (clock.now() < stalled_until) {
      wake = true;
      return;
    }
    wake = false;
    core->poll();
  }

  SimBoard& self;
  SimBoardConfig config;
  SimClock clock;
  Engine engine;
  SimCapture capture;
  SimByteLink link;
  SimFaultStore faults;
  std::vector<std::uint8_t> program;
  std::vector<symrig_wire_Event> events;
  std::vector<hal::Line> lines;
  std::uint32_t output_mask = 0;
  hal::BoardTraits traits;
  hal::Board hardware{traits, clock, engine, capture, link, faults};
  std::optional<firmware::Core> core;
  std::vector<Peripheral*> peripherals;
  std::uint64_t stalled_until = 0;
  bool wake = false;  // something happened that the firmware has not seen
};

SimBoard::SimBoard(SimBoardConfig config) : impl_(std::make_unique<Impl>(*this, std::move(config))) {}
SimBoard::~SimBoard() = default;

void SimBoard::attach(Peripheral& peripheral) {
  impl_->peripherals.push_back(&peripheral);
  peripheral.outputs_changed(now(), levels(), *this);
}

const SimBoardConfig& SimBoard::config() const {
  return impl_->config;
}

std::uint64_t SimBoard::now() const {
  return impl_->clock.now();
}

int SimBoard::line(std::string_view name) const {
  const auto& lines = impl_->config.lines;
  const auto found =
      std::find_if(lines.begin(), lines.end(), [name](const SimLine& line) { return line.name == name; });
  return found == lines.end() ? -1 : static_cast<int>(found - lines.begin());
}

std::uint32_t SimBoard::levels() const {
  return impl_->capture.levels();
}

void SimBoard::set_input(int line, bool level) {
  if (line < 0 || static_cast<std::size_t>(line) >= impl_->lines.size()) return;
  const std::uint32_t bit = 1U << static_cast<unsigned>(line);
  if ((impl_->output_mask & bit) != 0) return;
  if (impl_->capture.set(bit, level ? bit : 0, now())) impl_->wake = true;
}

void SimBoard::write(std::span<const std::uint8_t> bytes) {
  impl_->link.from_host(bytes);
  impl_->run_firmware();
}

std::vector<std::uint8_t> SimBoard::read() {
  return impl_->link.take_to_host();
}

std::uint64_t SimBoard::next_event() const {
  return impl_->next_event();
}

bool SimBoard::advance() {
  const std::uint64_t next = impl_->next_event();
  if (next == kNever) return false;
  impl_->clock.move_to(next);
  impl_->pass();
  return true;
}

void SimBoard::advance_to(std::uint64_t tick) {
  while (impl_->next_event() <= tick) advance();
  impl_->clock.move_to(tick);
}

int SimBoard::supervisor_state() const {
  return static_cast<int>(impl_->core->state());
}

std::uint32_t SimBoard::safe_levels() const {
  return impl_->core->safe_levels();
}

void SimBoard::stall_firmware_until(std::uint64_t tick) {
  impl_->stalled_until = tick;
}

void SimBoard::reboot() {
  impl_->power_up();
  impl_->wake = true;
}

void SimBoard::set_attached(bool attached) {
  impl_->link.set_attached(attached);
  impl_->wake = true;
}

void SimBoard::force_segment(std::uint32_t levels, std::uint32_t ticks) {
  impl_->engine.push({levels, ticks});
  if (impl_->engine.idle()) impl_->engine.start(now());
  impl_->engine.close();
  impl_->wake = true;
}

}  // namespace symrig::boards
