// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "interrupts.hpp"
#include "symrig/hal/peripherals.hpp"

namespace symrig::mega2560 {

// Times of the watchdog (data sheet table 12-2). avr-libc's <avr/wdt.h> does not compile with clang 14.
constexpr uint8_t kWatchdog16Ms = 0;
constexpr uint8_t kWatchdog250Ms = 1U << WDP2;

inline void feed_watchdog() {
  asm volatile("wdr");
}

/// Lets the watchdog reset the chip if it is not fed for this time. The two stores must be at most four
/// cycles apart.
inline void set_watchdog(uint8_t time) {
  const IrqLock lock;
  const auto change = static_cast<uint8_t>((1U << WDCE) | (1U << WDE));
  const auto bits = static_cast<uint8_t>((1U << WDE) | time);
  asm volatile("wdr \n sts %0, %1 \n sts %0, %2" ::"n"(_SFR_MEM_ADDR(WDTCSR)), "r"(change), "r"(bits));
}

/// Two places in the EEPROM. save() fills the older one, and its number is written last: a loss of power
/// leaves the other record.
class MegaSettings final : public hal::Settings {
 public:
  size_t load(uint8_t* out, size_t room) const override;
  /// Takes 3.4 ms for each byte that changes (data sheet table 7-1), and feeds the watchdog meanwhile.
  bool save(const uint8_t* bytes, size_t size) override;
};

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
