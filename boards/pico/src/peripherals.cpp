// SPDX-License-Identifier: Apache-2.0
#include "peripherals.hpp"

#include "board_pins.hpp"
#include "chip.hpp"
#include "registers.hpp"
#include "tick_clock.hpp"

namespace symrig::pico {
namespace {

constexpr uint32_t kWatchdogMicroseconds = 400'000;
constexpr uint32_t kWatchdogLoad = 2 * kWatchdogMicroseconds;  // it counts twice a microsecond (RP2040-E1)
constexpr uint32_t kWatchdogTrigger = 1U << 31U;
constexpr uint32_t kWatchdogEnable = 1U << 30U;
constexpr uint32_t kWatchdogResets = 0x1ffff & ~3U;  // all except the oscillators
constexpr uint32_t kHalfAliveWave = 1000;            // us

constexpr uint32_t kAskedFor = 0x5e1f'b007;  // scratch 0: software requested the reset
// Scratch 1: this firmware ran before the reset. The boot ROM restarts by the watchdog, too, after it has
// taken an image, and then the watchdog's reason alone says nothing.
constexpr uint32_t kWasRunning = 0x5e1f'4a11;

__attribute__((section(".noinit"))) Kept<hal::FaultRecord> kept;

void make_output(uint32_t pin) {
  reg(sio::gpio_out_clear) = 1U << pin;
  reg(sio::gpio_oe_set) = 1U << pin;
  reg(pads::pin(pin)) = pads::input_enable | pads::drive_4ma | pads::pull_down | pads::schmitt;
  reg(io::ctrl(pin)) = io::function_sio;
}

}  // namespace

void PicoWatchdog::begin() {
  make_output(kAlivePin);
  reg(watchdog::scratch1) = kWasRunning;
  reg(psm::wdsel) = kWatchdogResets;
  reg(watchdog::load) = kWatchdogLoad;
  // The pause bits stay 0: a debugger that halts the processor also stops the feed, and the board is reset.
  // PIO would go on otherwise (docs/board-pico-debug.md).
  reg(watchdog::ctrl) = kWatchdogEnable;
}

void PicoWatchdog::feed() {
  if (passed_ != all) return;
  passed_ = 0;
  reg(watchdog::load) = kWatchdogLoad;
  const uint64_t now = microseconds();
  if (now < toggle_at_) return;
  toggle_at_ = now + kHalfAliveWave;
  reg(sio::gpio_out_xor) = 1U << kAlivePin;
}

/// A crash counts as a fault, unless a fault came before it.
hal::FaultRecord PicoFaultStore::load() const {
  constexpr uint32_t kInternal = 8;  // FAULT_INTERNAL of the wire
  const hal::Crash& crash = last_crash();
  forget_crash();
  hal::FaultRecord record;
  if (kept.load(record) && record.code != 0) return record;
  const bool crashed = crash.exception != 0 && crash.exception != kSysTickException;
  return crashed ? hal::FaultRecord{kInternal, 0, crash.pc} : hal::FaultRecord{};
}

void PicoFaultStore::save(const hal::FaultRecord& record) {
  kept.save(record);
}

void PicoIndicator::begin() {
  make_output(kLedPin);
}

void PicoIndicator::show(bool on) {
  reg(on ? sio::gpio_out_set : sio::gpio_out_clear) = 1U << kLedPin;
}

void PicoSystem::begin() {
  constexpr uint32_t kTimer = 1;
  constexpr uint32_t kForced = 2;
  const uint32_t reason = reg(watchdog::reason);
  const uint32_t chip = reg(reset_chip::status);
  const bool asked_for = reg(watchdog::scratch0) == kAskedFor;
  const bool was_running = reg(watchdog::scratch1) == kWasRunning;
  reg(watchdog::scratch0) = 0;
  reg(watchdog::scratch1) = 0;
  if ((reason & (kForced | kTimer)) != 0) {
    cause_ = was_running && !asked_for ? hal::ResetCause::watchdog : hal::ResetCause::request;
  } else if ((chip & reset_chip::had_run_pin) != 0 && (chip & reset_chip::had_power_on) == 0) {
    cause_ = hal::ResetCause::pin;
  }
}

bool PicoSystem::diagnose(hal::Diagnostics& out) const {
  out.flash_reads = reg(xip::accesses);
  out.flash_hits = reg(xip::hits);
  out.queue_overflows = engine_.overflows();
  out.dma_errors = engine_.dma_errors();
  out.stack_free = stack_free();
  out.chip_revision = reg(sysinfo::chip_id) >> 28U;
  out.crash = last_crash();
  return true;
}

void MainLoopWatch::look(const ExceptionFrame& frame) {
  const bool idle = rounds_ == seen_;
  seen_ = rounds_;
  if (idle && !kept_) keep_crash(frame, kSysTickException);
  if (!idle && kept_) forget_crash();  // it went on
  kept_ = idle;
}

void PicoSystem::reboot(bool bootloader) {
  reg(watchdog::scratch1) = 0;
  const uint32_t usb_boot = bootloader ? rom_function('U', 'B') : 0;
  if (usb_boot != 0) {
    using UsbBoot = void (*)(uint32_t activity_pins, uint32_t disabled_interfaces);
    reinterpret_cast<UsbBoot>(usb_boot)(1U << kLedPin, 0);  // NOLINT(performance-no-int-to-ptr)
  }
  reg(watchdog::scratch0) = kAskedFor;
  reg(watchdog::ctrl) = kWatchdogEnable | kWatchdogTrigger;
}

}  // namespace symrig::pico
