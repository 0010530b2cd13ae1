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
  constexpr uint32_t kPriority = 1U << 30U;  // after trips
  reg(core::priority3) = kPriority;
  last_look_ = reg(timer::raw_low);
  reg(core::systick_ctrl) = 7;  // on, clk_sys, interrupt
  const auto coarse = static_cast<uint32_t>(microseconds()) * kTicksPerMicrosecond;
  phase_ = coarse + read_systick();
}

namespace {

SYMRIG_RAM Tick coarse_now() {
  const uint64_t us = microseconds();
  return (us << 7U) - (us << 1U) - us;  // * 125
}

}  // namespace

// SysTick counts down, so phase - systick counts up. It is exact modulo 2^24. TIMER is accurate to a few us.
SYMRIG_RAM int32_t TickClock::ahead(uint32_t systick, Tick coarse) const {
  return static_cast<int32_t>((phase_ - systick - static_cast<uint32_t>(coarse)) << 8U) >> 8;
}

SYMRIG_RAM Tick TickClock::at(uint32_t systick) const {
  const Tick coarse = coarse_now();
  return coarse + static_cast<Tick>(static_cast<int64_t>(ahead(systick, coarse)));
}

SYMRIG_RAM Tick TickClock::now() const {
  return at(read_systick());
}

bool TickClock::moves() {
  const uint32_t before = last_look_;
  last_look_ = reg(timer::raw_low);
  return last_look_ != before && sound();
}

bool TickClock::sound() const {
  constexpr int32_t kMost = 100 * static_cast<int32_t>(kTicksPerMicrosecond);
  const IrqLock lock;
  const int32_t apart = ahead(read_systick(), coarse_now());
  return apart > -kMost && apart < kMost;
}

}  // namespace symrig::pico
