// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "chip.hpp"
#include "edge_engine.hpp"
#include "symrig/hal/peripherals.hpp"

namespace symrig::pico {

/// The flash chip's 8-byte id. Call it before anything else runs. Zeros if there is no boot ROM.
void read_unique_id(uint8_t (&id)[8]);

/// Two sectors at the end of flash are used in turn. Each holds a record with a sequence number and a CRC.
/// The valid record with the higher number is the current one.
class PicoSettings final : public hal::Settings {
 public:
  size_t load(uint8_t* out, size_t room) const override;
  bool save(const uint8_t* bytes, size_t size) override;
};

/// The chip's watchdog, 400 ms, and the "alive" pin. The pin has a square wave of 2 ms, which stops if the
/// firmware is blocked. feed() continues both only if every checkpoint was passed since the last feed().
class PicoWatchdog final : public hal::Watchdog {
 public:
  static void begin();
  void feed() override;

  enum Checkpoint : uint8_t { engine = 1, pins = 2, clock = 4, all = 7 };
  void pass(Checkpoint point) { passed_ = static_cast<uint8_t>(passed_ | point); }

 private:
  uint64_t toggle_at_ = 0;  // us
  uint8_t passed_ = all;
};

/// In RAM that start-up does not touch, with a check word. It survives a reset, but not a loss of power.
class PicoFaultStore final : public hal::FaultStore {
 public:
  hal::FaultRecord load() const override;
  void save(const hal::FaultRecord& record) override;
};

/// The LED on the board.
class PicoIndicator final : public hal::Indicator {
 public:
  static void begin();
  void show(bool on) override;
};

/// Notices a main loop that hangs.
class MainLoopWatch {
 public:
  void end_round() { rounds_ = rounds_ + 1; }
  /// Called by SysTick's interrupt: if no round has ended since the last call, keeps the place.
  void look(const ExceptionFrame& frame);

 private:
  volatile uint32_t rounds_ = 0;
  uint32_t seen_ = 0;
  bool kept_ = false;
};

class PicoSystem final : public hal::System {
 public:
  explicit PicoSystem(const PicoEngine& engine) : engine_(engine) {}
  /// Finds out why the board has started. Call it before PicoWatchdog::begin().
  void begin();
  hal::ResetCause reset_cause() const override { return cause_; }
  void reboot(bool bootloader) override;
  bool diagnose(hal::Diagnostics& out) const override;

 private:
  const PicoEngine& engine_;
  hal::ResetCause cause_ = hal::ResetCause::power;
};

}  // namespace symrig::pico
