// SPDX-License-Identifier: Apache-2.0
// Registers of the RP2040 as far as the test images need them.
#pragma once

#include <stdint.h>

namespace rp {

using u8 = uint8_t;
using u16 = uint16_t;
using u32 = uint32_t;

inline volatile u32& reg(u32 address) {
  return *reinterpret_cast<volatile u32*>(address);
}

constexpr u32 kSet = 0x2000;
constexpr u32 kClear = 0x3000;

constexpr u32 kClocks = 0x40008000;
constexpr u32 kResets = 0x4000c000;
constexpr u32 kPsm = 0x40010000;
constexpr u32 kIoBank0 = 0x40014000;
constexpr u32 kXosc = 0x40024000;
constexpr u32 kPllSys = 0x40028000;
constexpr u32 kPllUsb = 0x4002c000;
constexpr u32 kTimer = 0x40054000;
constexpr u32 kWatchdog = 0x40058000;
constexpr u32 kUsbRam = 0x50100000;
constexpr u32 kUsb = 0x50110000;
constexpr u32 kSio = 0xd0000000;
constexpr u32 kSysTick = 0xe000e010;
constexpr u32 kNvicEnable = 0xe000e100;
constexpr u32 kNvicPend = 0xe000e200;
constexpr u32 kNvicUnpend = 0xe000e280;
constexpr u32 kNvicPriority = 0xe000e400;

constexpr u32 kIrqTimer0 = 0, kIrqTimer1 = 1, kIrqUsb = 5, kIrqGpio = 13, kIrqSpare = 26;

inline void release(u32 bits) {
  reg(kResets + kClear) = bits;
  while ((reg(kResets + 8) & bits) != bits) {
  }
}

inline void start_pll(u32 base, u32 reset_bit, u32 feedback, u32 post1, u32 post2) {
  release(1U << reset_bit);
  reg(base) = 1;
  reg(base + 8) = feedback;
  reg(base + 4 + kClear) = (1U << 0) | (1U << 5);
  while ((reg(base) >> 31) == 0) {
  }
  reg(base + 12) = (post1 << 16) | (post2 << 12);
  reg(base + 4 + kClear) = 1U << 3;
}

/// clk_sys 125 MHz, clk_usb 48 MHz, the tick of one microsecond.
inline void start_clocks() {
  reg(kXosc + 0x0c) = 47;
  reg(kXosc) = 0x00fabaa0;
  while ((reg(kXosc + 4) >> 31) == 0) {
  }
  start_pll(kPllSys, 12, 125, 6, 2);
  start_pll(kPllUsb, 13, 100, 5, 5);
  reg(kClocks + 0x30) = 2;  // clk_ref from the crystal
  while (reg(kClocks + 0x38) != 4) {
  }
  reg(kClocks + 0x3c) = 0;
  reg(kClocks + 0x3c) = 1;  // clk_sys from PLL_SYS
  while (reg(kClocks + 0x44) != 2) {
  }
  reg(kClocks + 0x54) = 1U << 11;  // clk_usb from PLL_USB
  reg(kWatchdog + 0x2c) = 12 | (1U << 9);
  release((1U << 5) | (1U << 8) | (1U << 21));
}

inline void sio_output(u32 gpio) {
  reg(kIoBank0 + 8 * gpio + 4) = 5;
  reg(kSio + 0x24) = 1U << gpio;
}
inline void set_high(u32 gpio) {
  reg(kSio + 0x14) = 1U << gpio;
}
inline void set_low(u32 gpio) {
  reg(kSio + 0x18) = 1U << gpio;
}
inline void toggle(u32 gpio) {
  reg(kSio + 0x1c) = 1U << gpio;
}

inline void enable_irq(u32 irq) {
  reg(kNvicEnable) = 1U << irq;
}
inline void set_priority(u32 irq, u32 level) {
  volatile u32& word = reg(kNvicPriority + (irq & ~3U));
  word = (word & ~(0xffU << (8 * (irq & 3)))) | (level << (8 * (irq & 3) + 6));
}
inline void sleep() {
  asm volatile("wfi" ::: "memory");
}
inline void mask_irqs() {
  asm volatile("cpsid i" ::: "memory");
}
inline void unmask_irqs() {
  asm volatile("cpsie i" ::: "memory");
}

/// Where a test looks for results.
struct Results {
  u32 count;
  u32 values[255];
};
extern volatile Results results;
inline void tell(u32 value) {
  results.values[results.count] = value;
  results.count = results.count + 1;
}

}  // namespace rp

/// Each image defines its results by this, and clears them where it wants to.
#define RP_RESULTS __attribute__((section(".results"))) volatile rp::Results rp::results
