// SPDX-License-Identifier: Apache-2.0
#include "chip.hpp"
#include "registers.hpp"

namespace symrig::pico {
namespace {

void leave_reset(uint32_t blocks) {
  reg(resets::base + kClear) = blocks;
  while ((reg(resets::done) & blocks) != blocks) {
  }
}

/// Crystal * feedback / (post1 * post2); the product before division must lie in 750..1600 MHz.
void start_pll(uint32_t base, uint32_t block, uint32_t feedback, uint32_t post1, uint32_t post2) {
  constexpr uint32_t kPowerDown = 1U << 0U;
  constexpr uint32_t kPostDown = 1U << 3U;
  constexpr uint32_t kVcoDown = 1U << 5U;
  reg(resets::base + kSet) = block;
  leave_reset(block);
  reg(base) = 1;  // reference not divided
  reg(base + 0x8) = feedback;
  reg(base + 0x4 + kClear) = kPowerDown | kVcoDown;
  while ((reg(base) >> 31U) == 0) {
  }
  reg(base + 0xc) = (post1 << 16U) | (post2 << 12U);
  reg(base + 0x4 + kClear) = kPostDown;
}

void start_crystal() {
  reg(xosc::ctrl) = 0xaa0;  // 1..15 MHz
  reg(xosc::startup) = 47;  // 1 ms
  reg(xosc::ctrl + kSet) = 0xfabU << 12U;
  while ((reg(xosc::status) >> 31U) == 0) {
  }
}

/// Switches to the ring oscillator first, because the boot ROM or a reset may have left the clocks in any
/// state.
void leave_plls() {
  reg(clocks::resus_ctrl) = 0;
  reg(clocks::sys_ctrl + kClear) = 1;
  while (reg(clocks::sys_selected) != 1) {
  }
  reg(clocks::ref_ctrl + kClear) = 3;
  while (reg(clocks::ref_selected) != 1) {
  }
}

void select_clocks() {
  reg(clocks::ref_div) = 1U << 8U;
  reg(clocks::ref_ctrl) = 2;  // crystal
  while (reg(clocks::ref_selected) != 4) {
  }
  reg(clocks::sys_div) = 1U << 8U;
  reg(clocks::sys_ctrl) = 0;  // PLL as the auxiliary source...
  reg(clocks::sys_ctrl + kSet) = 1;
  while (reg(clocks::sys_selected) != 2) {
  }
  reg(clocks::usb_ctrl) = 0;
  reg(clocks::usb_div) = 1U << 8U;
  reg(clocks::usb_ctrl) = 1U << 11U;
  reg(clocks::peri_ctrl) = 1U << 11U;
}

}  // namespace

void start_clocks() {
  leave_plls();
  start_crystal();
  start_pll(pll::sys, resets::pll_sys, 125, 6, 2);  // 12 MHz * 125 / 12 = 125 MHz
  start_pll(pll::usb, resets::pll_usb, 100, 5, 5);  // 12 MHz * 100 / 25 = 48 MHz
  select_clocks();
  reg(watchdog::tick) = 12 | (1U << 9U);  // 12 cycles of the crystal = 1 us
  const uint32_t blocks = resets::dma | resets::io_bank0 | resets::pads_bank0 | resets::pio0 | resets::pio1 |
                          resets::timer | resets::usb;
  const uint32_t fresh = blocks & ~(resets::io_bank0 | resets::pads_bank0);
  reg(resets::base + kSet) = fresh;
  leave_reset(blocks);
}

}  // namespace symrig::pico
