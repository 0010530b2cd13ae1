// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "irq_lock.hpp"

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

}  // namespace symrig::mega2560
