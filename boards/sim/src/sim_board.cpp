// SPDX-License-Identifier: Apache-2.0
#include "symrig/boards/sim_board.hpp"

#include "engine.hpp"
#include "symrig/boards/pin_log.hpp"
#include "symrig/firmware/core.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

namespace symrig::board_sim {
namespace {

constexpr std::size_t kLinkRoom = std::size_t{1} << 16U;  // bytes to the host that are not read yet
constexpr std::size_t kCaptureDepth = 4096;
constexpr std::size_t kEvents = 1024;
constexpr std::array<std::uint8_t, 8> kUniqueId{'s', 'i', 'm', '-', '0', '0', '0', '1'};

/// Time-stamped changes of the pins.
class SimCapture final : public hal::Capture {
 public:
  std::uint32_t levels() const override { return levels_; }
  bool pop(hal::CapturedEdge& edge) override { return log_.pop(edge, hal::kNever); }
  bool take_overflow() override { return log_.take_overflow(); }

  /// Sets the lines in `mask` to `levels`. Returns true if any line changed.
  bool set(std::uint32_t mask, std::uint32_t levels, std::uint64_t tick) {
    const std::uint32_t changed = (levels_ ^ levels) & mask;
    levels_ ^= changed;
    log_.add_changes(changed, levels_, tick);
    return changed != 0;
  }
  bool pending() const { return log_.ready_at() != hal::kNever; }

 private:
  board_common::PinLog log_{kCaptureDepth, 0, true};  // edges are known at once
  std::uint32_t levels_ = 0;
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

class SimSettings final : public hal::Settings {
 public:
  std::size_t load(std::uint8_t* out, std::size_t room) const override {
    if (record_.size() > room) return 0;
    std::copy(record_.begin(), record_.end(), out);
    return record_.size();
  }
  bool save(const std::uint8_t* bytes, std::size_t size) override {
    if (broken_ || size > kRoom) return false;
    record_.assign(bytes, bytes + size);
    return true;
  }
  void break_down() { broken_ = true; }

 private:
  std::vector<std::uint8_t> record_;
  bool broken_ = false;
};

/// A reset takes no virtual time, so outputs have their power-up levels for zero ticks.
class SimSystem final : public hal::System {
 public:
  hal::ResetCause reset_cause() const override { return cause_; }
  void reboot(bool bootloader) override {
    asked_ = true;
    bootloader_ = bootloader;
  }

  bool take_reboot() { return std::exchange(asked_, false); }
  bool bootloader() const { return bootloader_; }
  void started(hal::ResetCause cause) {
    cause_ = cause;
    bootloader_ = false;
  }

 private:
  hal::ResetCause cause_ = hal::ResetCause::power;
  bool asked_ = false;
  bool bootloader_ = false;
};

/// Simulated firmware runs only when it has something to do, and a real one at least every millisecond. So a
/// round that ends without a feed starts the watchdog, not the time without a round. A stall says how long
/// the firmware does not run.
class SimWatchdog final : public hal::Watchdog {
 public:
  explicit SimWatchdog(std::uint64_t patience) : patience_(patience) {}
  void feed() override { fed_ = true; }

  /// The tick of the reset; kNever while the firmware feeds.
  std::uint64_t resets_at() const { return resets_at_; }
  void restart() {
    fed_ = false;
    resets_at_ = kNever;
  }
  void end_round(std::uint64_t tick) {
    const bool fed = std::exchange(fed_, false);
    resets_at_ = fed ? kNever : std::min(resets_at_, tick + patience_);
  }

 private:
  std::uint64_t patience_;
  std::uint64_t resets_at_ = kNever;
  bool fed_ = false;
};

class SimIndicator final : public hal::Indicator {
 public:
  void show(bool on) override { on_ = on; }
  bool on() const { return on_; }

 private:
  bool on_ = false;
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
  return {{"projector_trigger", true}, {"camera_trigger", true}, {"lamp_enable", true}, {"vsync", false},
          {"camera_strobe", false},    {"interlock", false}};
}

struct SimBoard::Impl final : board_common::WordSink {
  Impl(SimBoard& board, SimBoardConfig wanted)
      : self(board),
        config(std::move(wanted)),
        clock(config.start_tick),
        engine(*this, clock, capture, std::max<std::uint32_t>(config.engine_segments, 2),
               config.wait_latency),
        program(std::size_t{config.program_records} * protocol::kRecordSize),
        events(kEvents),
        marks(std::max<std::uint32_t>(config.engine_segments, protocol::kMaxMarksInARow)) {
    for (const SimLine& line : config.lines) {
      if (line.output) output_mask |= 1U << lines.size();
      const std::uint8_t waits = line.output ? std::uint8_t{0} : hal::waits::all;
      lines.push_back({line.name.c_str(), "", line.output, waits, !line.output, 1});
    }
    traits = {"sim",
              kUniqueId.data(),
              static_cast<std::uint8_t>(kUniqueId.size()),
              lines.data(),
              static_cast<std::uint8_t>(lines.size()),
              config.tick_hz,
              config.min_dwell,
              UINT32_MAX,
              config.wait_latency,
              std::max<std::uint32_t>(config.engine_segments, 2),
              config.refill_ticks,
              config.poll_ticks};
    start_up(hal::ResetCause::power);
  }

  /// No firmware drives the outputs: they have the levels of their pull-downs, also after a trip.
  void release_outputs() {
    engine.set_trips(0, 0);
    engine.force(0);
  }

  void start_up(hal::ResetCause cause) {
    release_outputs();
    watchdog.restart();
    watchdog_at = kNever;
    stalled_until = 0;
    system.started(cause);
    core.emplace(hardware, firmware::Memory{{program.data(), program.size()},
                                            events.data(),
                                            static_cast<std::uint16_t>(events.size()),
                                            {marks.data(), static_cast<std::uint32_t>(marks.size())}});
    core->boot();
    wake = true;
  }

  // WordSink
  hal::Tick put(std::uint32_t levels) override {
    if (capture.set(output_mask, levels, clock.now()))
      for (Peripheral* peripheral : peripherals)
        peripheral->outputs_changed(clock.now(), capture.levels(), self);
    return clock.now();
  }
  hal::Tick put_all(std::uint32_t levels) override { return put(levels); }

  std::uint64_t peripherals_next() const {
    std::uint64_t next = kNever;
    for (const Peripheral* peripheral : peripherals) next = std::min(next, peripheral->next_event());
    return next;
  }
  std::uint64_t firmware_next() const {
    if (system.bootloader()) return kNever;
    const std::uint64_t wanted = wake ? clock.now() : core->next_deadline();
    return wanted == kNever ? kNever : std::max(wanted, stalled_until);
  }
  std::uint64_t reset_at() const { return std::min(watchdog_at, watchdog.resets_at()); }
  std::uint64_t next_event() const {
    const std::uint64_t next =
        std::min({engine.next_event(), peripherals_next(), firmware_next(), reset_at()});
    return next == kNever ? kNever : std::max(next, clock.now());
  }

  /// Handles everything that is due now, once: first hardware, then peripherals, then firmware.
  void pass() {
    if (engine.next_event() <= clock.now()) {
      engine.step();
      wake = true;
    }
    for (Peripheral* peripheral : peripherals)
      if (peripheral->next_event() <= clock.now()) peripheral->on_event(clock.now(), self);
    wake = wake || capture.pending();
    if (reset_at() <= clock.now()) start_up(hal::ResetCause::watchdog);
    if (firmware_next() <= clock.now()) run_firmware();
  }

  void run_firmware() {
    if (system.bootloader()) return;
    if (clock.now() < stalled_until) {
      wake = true;
      return;
    }
    wake = false;
    watchdog_at = kNever;
    do {
      core->poll();
      watchdog.end_round(clock.now());
    } while (core->busy() || capture.pending());  // the firmware takes no virtual time
    if (!system.take_reboot()) return;
    if (system.bootloader()) {
      release_outputs();
    } else {
      start_up(hal::ResetCause::request);
    }
  }

  void stall(std::uint64_t until) {
    stalled_until = until;
    watchdog_at = kNever;
    const std::uint64_t patience = config.tick_hz * kSimWatchdogMs / 1000;
    if (until > clock.now() + patience) watchdog_at = clock.now() + patience;
  }

  SimBoard& self;
  SimBoardConfig config;
  SimClock clock;
  SimCapture capture;
  Engine engine;
  SimByteLink link;
  SimFaultStore faults;
  std::vector<std::uint8_t> program;
  std::vector<symrig_wire_Event> events;
  std::vector<firmware::QueuedMark> marks;
  SimWatchdog watchdog{config.tick_hz * kSimWatchdogMs / 1000};
  SimIndicator indicator;
  SimSettings settings;
  SimSystem system;
  std::vector<hal::Line> lines;
  std::uint32_t output_mask = 0;
  hal::BoardTraits traits;
  hal::Board hardware{traits, clock, engine, capture, link, faults, watchdog, indicator, settings, system};
  std::optional<firmware::Core> core;
  std::vector<Peripheral*> peripherals;
  std::uint64_t stalled_until = 0;
  std::uint64_t watchdog_at = kNever;  // end of the firmware's stall
  bool wake = false;                   // an event that the firmware has not handled yet
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
  if (!impl_->capture.set(bit, level ? bit : 0, now())) return;
  impl_->engine.input_changed(static_cast<std::uint8_t>(line), level);
  impl_->wake = true;
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
  impl_->stall(tick);
}

void SimBoard::reboot() {
  impl_->start_up(hal::ResetCause::power);
}

bool SimBoard::light() const {
  return impl_->indicator.on();
}

bool SimBoard::in_bootloader() const {
  return impl_->system.bootloader();
}

void SimBoard::break_settings() {
  impl_->settings.break_down();
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

}  // namespace symrig::board_sim
