// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/clock.hpp"

#include <avr/io.h>
#include <stdint.h>  // NOLINT(modernize-deprecated-headers)

namespace symrig::mega2560 {

/// The low 32 bits of a tick. They wrap after 35 minutes: compare two of them by before().
using ShortTick = uint32_t;

/// True if `a` is earlier than `b`. They are less than 2^31 ticks (17 minutes) apart.
constexpr bool before(ShortTick a, ShortTick b) {
  return static_cast<int32_t>(a - b) < 0;
}

/// Timer 3 at clk/8 (2 MHz, ATmega2560 data sheet DS40002211, section 17), extended by its overflows. It
/// lasts for 4 years. Nothing writes to this timer while it counts.
class TickClock final : public hal::Clock {
 public:
  static void begin();
  hal::Tick now() const override;
  /// Call these with interrupts off.
  ShortTick now_locked() const;
  hal::Tick long_now_locked() const;
  /// The tick, at most 17 minutes old, with these low bits.
  hal::Tick extend(ShortTick tick) const;
  /// The lowest 16 bits.
  static uint16_t count() { return TCNT3; }
  /// Called by the timer's overflow interrupt.
  void overflowed() { overflows_ = overflows_ + 1; }

 private:
  uint32_t overflows_locked(uint16_t count) const;

  volatile uint32_t overflows_ = 0;
};

}  // namespace symrig::mega2560
