// SPDX-License-Identifier: Apache-2.0
#include "tick_clock.hpp"

namespace symrig::pico {

using hal::Tick;

SYMRIG_RAM uint64_t microseconds() {
  uint32_t high = 0;
  uint32_t low = 0;
  do {
    high = reg(timer::raw_high);
    low = reg(timer::raw_low);
  } while (high != reg(timer::raw_high));
  return (uint64_t{high} << 32U) | low;
}

void TickClock::start() {
  reg(core::systick_ctrl) = 0;
  reg(core::systick_reload) = kSystickMask;
  reg(core::systick) = 0;
  reg(core::systick_ctrl) = 5;  // on, clk_sys, no interrupt
  const auto coarse = static_cast<uint32_t>(microseconds()) * kTicksPerMicrosecond;
  phase_ = coarse + read_systick();
}

// SysTick counts down, so phase - systick counts up. It is right modulo 2^24; TIMER is right to a few us.
SYMRIG_RAM Tick TickClock::at(uint32_t systick) const {
  const uint64_t us = microseconds();
  const Tick coarse = (us << 7U) - (us << 1U) - us;  // * 125
  const uint32_t ahead = (phase_ - systick - static_cast<uint32_t>(coarse)) << 8U;
  return coarse + static_cast<Tick>(static_cast<int64_t>(static_cast<int32_t>(ahead) >> 8));
}

SYMRIG_RAM Tick TickClock::now() const {
  return at(read_systick());
}

}  // namespace symrig::pico
