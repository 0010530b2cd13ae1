// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdint.h>  // NOLINT(modernize-deprecated-headers)

// Start-up copies all code to RAM (link.ld): no cache miss delays it, and it may run while the flash is
// written. check_flash.py keeps it so.

/// Code of its own, which callers' code must not contain.
#define SYMRIG_RAM __attribute__((noinline))
/// Runs in flash, before the copy. It calls nothing else.
#define SYMRIG_FLASH __attribute__((section(".startup"), noinline))

/// The RP2040's registers that this board uses. Names and offsets are those of the data sheet.
namespace symrig::pico {

/// A 32-bit register at a fixed address.
inline volatile uint32_t& reg(uint32_t address) {
  return *reinterpret_cast<volatile uint32_t*>(address);  // NOLINT(performance-no-int-to-ptr)
}

/// Address of a register or of memory, for DMA.
inline uint32_t address_of(const volatile void* thing) {
  return static_cast<uint32_t>(reinterpret_cast<uintptr_t>(thing));
}

// Aliases of each peripheral register that set or clear the bits written.
constexpr uint32_t kSet = 0x2000;
constexpr uint32_t kClear = 0x3000;

namespace clocks {
constexpr uint32_t base = 0x40008000;
constexpr uint32_t ref_ctrl = base + 0x30, ref_div = base + 0x34, ref_selected = base + 0x38;
constexpr uint32_t sys_ctrl = base + 0x3c, sys_div = base + 0x40, sys_selected = base + 0x44;
constexpr uint32_t peri_ctrl = base + 0x48;
constexpr uint32_t usb_ctrl = base + 0x54, usb_div = base + 0x58;
constexpr uint32_t resus_ctrl = base + 0x78;
}  // namespace clocks

namespace resets {
constexpr uint32_t base = 0x4000c000;
constexpr uint32_t done = base + 0x8;
constexpr uint32_t dma = 1U << 2U, io_bank0 = 1U << 5U, pads_bank0 = 1U << 8U, pio0 = 1U << 10U,
                   pio1 = 1U << 11U, pll_sys = 1U << 12U, pll_usb = 1U << 13U, timer = 1U << 21U,
                   usb = 1U << 24U;
}  // namespace resets

namespace psm {
constexpr uint32_t wdsel = 0x40010008;
}

namespace io {
constexpr uint32_t base = 0x40014000;
constexpr uint32_t ctrl(uint32_t pin) {
  return base + 8 * pin + 4;
}
constexpr uint32_t intr(uint32_t group) {
  return base + 0xf0 + 4 * group;
}
constexpr uint32_t inte(uint32_t group) {
  return base + 0x100 + 4 * group;
}
constexpr uint32_t ints(uint32_t group) {
  return base + 0x120 + 4 * group;
}
constexpr uint32_t function_sio = 5, function_pio0 = 6, function_none = 0x1f;
// Four interrupt bits per pin, eight pins per group.
constexpr uint32_t edge_low = 4, edge_high = 8;
}  // namespace io

namespace pads {
constexpr uint32_t pin(uint32_t number) {
  return 0x4001c000 + 4 + 4 * number;
}
constexpr uint32_t schmitt = 1U << 1U, pull_down = 1U << 2U, drive_4ma = 1U << 4U, input_enable = 1U << 6U;
}  // namespace pads

namespace xosc {
constexpr uint32_t ctrl = 0x40024000, status = 0x40024004, startup = 0x4002400c;
}

namespace pll {
constexpr uint32_t sys = 0x40028000, usb = 0x4002c000;
}

namespace timer {
constexpr uint32_t base = 0x40054000;
constexpr uint32_t alarm0 = base + 0x10, alarm1 = base + 0x14, raw_high = base + 0x24, raw_low = base + 0x28,
                   intr = base + 0x34, inte = base + 0x38;
}  // namespace timer

namespace watchdog {
constexpr uint32_t base = 0x40058000;
constexpr uint32_t ctrl = base, load = base + 0x4, reason = base + 0x8, scratch0 = base + 0xc,
                   scratch1 = base + 0x10, tick = base + 0x2c;
}  // namespace watchdog

namespace sysinfo {
constexpr uint32_t chip_id = 0x40000000;
}

namespace xip {
constexpr uint32_t hits = 0x1400000c, accesses = 0x14000010;
}

namespace reset_chip {
constexpr uint32_t status = 0x40064008;
constexpr uint32_t had_power_on = 1U << 8U, had_run_pin = 1U << 16U;
}  // namespace reset_chip

namespace dma {
constexpr uint32_t base = 0x50000000;
constexpr uint32_t channel(uint32_t n) {
  return base + 0x40 * n;
}
// Offsets in a channel. al1 and al3 are aliases in another order; writing their last register triggers.
constexpr uint32_t read_addr = 0x0, write_addr = 0x4, trans_count = 0x8, ctrl_trig = 0xc, al1_ctrl = 0x10,
                   al1_trans_count_trig = 0x1c, al3_read_addr_trig = 0x3c;
constexpr uint32_t intr = base + 0x400, inte0 = base + 0x404, ints0 = base + 0x40c, abort = base + 0x444;
constexpr uint32_t enable = 1, high_priority = 2, errors = 7U << 29U, word = 2U << 2U, incr_read = 1U << 4U,
                   incr_write = 1U << 5U, ring_on_write = 1U << 10U, irq_quiet = 1U << 21U, busy = 1U << 24U,
                   unpaced = 0x3fU << 15U;
constexpr uint32_t ring(uint32_t bits) {
  return bits << 6U;
}
constexpr uint32_t chain(uint32_t to) {
  return to << 11U;
}
constexpr uint32_t dreq(uint32_t n) {
  return n << 15U;
}
constexpr uint32_t dreq_pio0_tx0 = 0, dreq_pio1_rx0 = 12;
}  // namespace dma

namespace pio {
constexpr uint32_t pio0 = 0x50200000, pio1 = 0x50300000;
constexpr uint32_t ctrl = 0x0, fdebug = 0x8, flevel = 0xc, txf0 = 0x10, rxf0 = 0x20, irq = 0x30,
                   padout = 0x3c, instr_mem = 0x48, irq0_inte = 0x12c;
// Of one state machine; the next one is 0x18 further.
constexpr uint32_t clkdiv = 0xc8, execctrl = 0xcc, shiftctrl = 0xd0, instr = 0xd8, pinctrl = 0xdc;
constexpr uint32_t machine(uint32_t n) {
  return 0x18 * n;
}
}  // namespace pio

namespace usb {
constexpr uint32_t ram = 0x50100000;
constexpr uint32_t base = 0x50110000;
constexpr uint32_t addr_endp = base, main_ctrl = base + 0x40, frame = base + 0x48, sie_ctrl = base + 0x4c,
                   sie_status = base + 0x50, buff_status = base + 0x58, ep_abort = base + 0x60,
                   ep_abort_done = base + 0x64, ep_stall_arm = base + 0x68, muxing = base + 0x74,
                   power = base + 0x78, inte = base + 0x90, ints = base + 0x98;
}  // namespace usb

namespace sio {
constexpr uint32_t base = 0xd0000000;
constexpr uint32_t gpio_in = base + 0x4, gpio_out_set = base + 0x14, gpio_out_clear = base + 0x18,
                   gpio_out_xor = base + 0x1c, gpio_oe_set = base + 0x24;
}  // namespace sio

namespace core {
constexpr uint32_t vtor = 0xe000ed08, priority3 = 0xe000ed20, mpu_ctrl = 0xe000ed94, mpu_base = 0xe000ed9c,
                   mpu_attributes = 0xe000eda0;
constexpr uint32_t systick_ctrl = 0xe000e010, systick_reload = 0xe000e014, systick = 0xe000e018;
constexpr uint32_t irq_set_enable = 0xe000e100, irq_clear_enable = 0xe000e180, irq_set_pending = 0xe000e200,
                   irq_clear_pending = 0xe000e280, irq_priority = 0xe000e400;
}  // namespace core

// Interrupt numbers.
namespace irq {
constexpr uint32_t timer0 = 0, timer1 = 1, usb = 5, pio0_0 = 7, dma0 = 11, gpio = 13;
}

/// Enables an interrupt. priority: 0 (highest) to 3.
inline void enable_irq(uint32_t number, uint32_t priority) {
  const uint32_t address = core::irq_priority + (number & ~3U);
  const uint32_t shift = 8 * (number & 3U) + 6;
  reg(address) = (reg(address) & ~(3U << shift)) | (priority << shift);
  reg(core::irq_clear_pending) = 1U << number;
  reg(core::irq_set_enable) = 1U << number;
}

/// Disables all interrupts while it exists.
class IrqLock {
 public:
  IrqLock() { asm volatile("mrs %0, primask\n cpsid i" : "=r"(before_)::"memory"); }
  ~IrqLock() { asm volatile("msr primask, %0" ::"r"(before_) : "memory"); }
  IrqLock(const IrqLock&) = delete;
  IrqLock& operator=(const IrqLock&) = delete;

 private:
  uint32_t before_;
};

/// Disables one interrupt while it exists. The others, above all trips, stay enabled.
class IrqHold {
 public:
  explicit IrqHold(uint32_t number) : bit_(1U << number) {
    reg(core::irq_clear_enable) = bit_;
    asm volatile("dsb\n isb" ::: "memory");
  }
  ~IrqHold() {
    asm volatile("" ::: "memory");
    reg(core::irq_set_enable) = bit_;
  }
  IrqHold(const IrqHold&) = delete;
  IrqHold& operator=(const IrqHold&) = delete;

 private:
  uint32_t bit_;
};

}  // namespace symrig::pico

/// Bits and memory of the USB controller, with the names of the data sheet.
namespace symrig::pico::usb {

// Buffer control.
constexpr uint32_t kAvailable = 1U << 10U, kStall = 1U << 11U, kData1 = 1U << 13U, kLast = 1U << 14U,
                   kFull = 1U << 15U;
constexpr uint32_t kLengthMask = 0x3ff;
// SIE_STATUS and interrupts.
constexpr uint32_t kSieSuspended = 1U << 4U, kSieResume = 1U << 11U, kSieSetup = 1U << 17U,
                   kSieReset = 1U << 19U;
constexpr uint32_t kIntBuffer = 1U << 4U, kIntReset = 1U << 12U, kIntSuspend = 1U << 14U,
                   kIntResume = 1U << 15U, kIntSetup = 1U << 16U, kIntFrame = 1U << 17U;
constexpr uint32_t kPullUp = 1U << 16U;  // of SIE_CTRL

// The controller's memory: first control words, then a 64-byte buffer for each direction of each endpoint.
constexpr uint32_t kControlBuffer = 0x100;
constexpr uint32_t buffer(uint32_t endpoint, bool out) {
  return endpoint == 0 ? kControlBuffer : 0x180 + 0x80 * (endpoint - 1) + (out ? 0x40 : 0);
}
inline volatile uint32_t& buffer_control(uint32_t endpoint, bool out) {
  return reg(usb::ram + 0x80 + 8 * endpoint + (out ? 4 : 0));
}
inline volatile uint32_t& endpoint_control(uint32_t endpoint, bool out) {
  return reg(usb::ram + 8 * endpoint + (out ? 4 : 0));
}
constexpr uint32_t buff_status_bit(uint32_t endpoint, bool out) {
  return 1U << (2 * endpoint + (out ? 1 : 0));
}

}  // namespace symrig::pico::usb
