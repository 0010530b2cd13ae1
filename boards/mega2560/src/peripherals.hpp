// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/fault_store.hpp"
#include "symrig/hal/indicator.hpp"
#include "symrig/hal/system.hpp"
#include "symrig/hal/watchdog.hpp"
#include "tick_clock.hpp"

namespace symrig::mega2560 {

/// The chip's watchdog, 250 ms from its own oscillator (data sheet section 12.5). It resets the chip: all
/// pins are inputs then, and the resistors at the hazardous lines hold them.
///
/// Limits and keep-alives are worth nothing if the clock stands still, because its interrupt does not come.
/// Timer 4 counts without interrupts. The watchdog gets no feed while both disagree.
class MegaWatchdog final : public hal::Watchdog {
 public:
  explicit MegaWatchdog(const TickClock& clock) : clock_(clock) {}

  /// The clock must run.
  void begin();
  void feed() override;

 private:
  /// Timer 4 less the clock, in steps of 64 us; modulo 2^16.
  uint16_t apart() const;

  const TickClock& clock_;
  uint16_t apart_ = 0;  // at the start
};

/// In RAM that start-up does not touch, with a check word. It survives a reset, but not a loss of power.
class MegaFaultStore final : public hal::FaultStore {
 public:
  hal::FaultRecord load() const override;
  void save(const hal::FaultRecord& record) override;
};

/// The LED on the board (PB7, D13).
class MegaIndicator final : public hal::Indicator {
 public:
  static void begin();
  void show(bool on) override;
};

class MegaSystem final : public hal::System {
 public:
  /// Finds out why the board has started. Call it first.
  void begin();
  hal::ResetCause reset_cause() const override { return cause_; }
  /// Restarts by the watchdog, after 15 ms. The chip's boot loader waits for a programmer after each reset,
  /// so `bootloader` changes nothing.
  void reboot(bool bootloader) override;

 private:
  hal::ResetCause cause_ = hal::ResetCause::power;
};

}  // namespace symrig::mega2560
