// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "registers.hpp"
#include "symrig/hal/clock.hpp"

namespace symrig::pico {

constexpr uint32_t kTicksPerMicrosecond = 125;
constexpr uint32_t kSystickMask = 0xffffff;

/// The board's clock in cycles of clk_sys (8 ns). SysTick gives the lowest 24 bits, TIMER the others (1 us,
/// 64 bits, from the same crystal). The only state is the phase between them, so any interrupt may read it.
class TickClock final : public hal::Clock {
 public:
  /// Starts SysTick and measures the phase.
  void start();
  hal::Tick now() const override;
  /// The tick at which SysTick has the value `systick`. Of all such ticks, the one nearest to now.
  hal::Tick at(uint32_t systick) const;
  /// true: SysTick (PLL) and TIMER (crystal) agree to within 100 us since the board started.
  bool sound() const;
  /// Called by SysTick's interrupt, every 134 ms: false if TIMER stands still, or if the two do not agree.
  bool moves();

 private:
  int32_t ahead(uint32_t systick, hal::Tick coarse) const;

  uint32_t phase_ = 0;
  uint32_t last_look_ = 0;  // us
};

inline uint32_t read_systick() {
  return reg(core::systick);
}
/// Of TIMER, 64 bits.
uint64_t microseconds();

}  // namespace symrig::pico
