// SPDX-License-Identifier: Apache-2.0
#include "tick_clock.hpp"

#include "interrupts.hpp"

namespace symrig::mega2560 {

void TickClock::begin() {
  TCCR3A = 0;
  TCCR3B = 1U << CS31;  // clk/8
  TIFR3 = 1U << TOV3;
  TIMSK3 = 1U << TOIE3;
}

/// count: read just before. Its overflow may be pending.
uint32_t TickClock::overflows_locked(uint16_t count) const {
  const bool pending = (TIFR3 & (1U << TOV3)) != 0 && count < 0x8000U;
  return overflows_ + (pending ? 1U : 0U);
}

ShortTick TickClock::now_locked() const {
  const uint16_t low = count();
  return (overflows_locked(low) << 16U) | low;
}

hal::Tick TickClock::now() const {
  const IrqLock lock;
  return long_now_locked();
}

hal::Tick TickClock::long_now_locked() const {
  const uint16_t low = count();
  return (hal::Tick{overflows_locked(low)} << 16U) | low;
}

hal::Tick TickClock::extend(ShortTick tick) const {
  const hal::Tick present = now();
  return present - static_cast<ShortTick>(static_cast<ShortTick>(present) - tick);
}

}  // namespace symrig::mega2560
