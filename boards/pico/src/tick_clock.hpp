// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "registers.hpp"
#include "symrig/hal/clock.hpp"

namespace symrig::pico {

constexpr uint32_t kTicksPerMicrosecond = 125;
constexpr uint32_t kSystickMask = 0xffffff;

/// The board's clock in cycles of clk_sys (8 ns). The lowest 24 bits are SysTick's, the rest comes from TIMER
/// (1 us, 64 bits, from the same crystal): no state but the phase between them, so any interrupt may ask.
class TickClock final : public hal::Clock {
 public:
  /// Starts SysTick and measures the phase.
  void start();
  hal::Tick now() const override;
  /// The tick at which SysTick stood (or will stand) at `systick`, the one nearest to now.
  hal::Tick at(uint32_t systick) const;
  /// SysTick (PLL) and TIMER (crystal) still agree: to within 100 us for as long as the board runs.
  bool sound() const;

 private:
  int32_t ahead(uint32_t systick, hal::Tick coarse) const;

  uint32_t phase_ = 0;
};

inline uint32_t read_systick() {
  return reg(core::systick);
}
/// Of TIMER, 64 bits.
uint64_t microseconds();

}  // namespace symrig::pico
