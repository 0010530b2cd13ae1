// SPDX-License-Identifier: Apache-2.0
#include "peripherals.hpp"

#include "board_pins.hpp"
#include "registers.hpp"
#include "rom.hpp"
#include "symrig/protocol/crc32c.hpp"
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

struct KeptFault {
  hal::FaultRecord record;
  uint32_t check;
};
__attribute__((section(".noinit"))) KeptFault kept;

uint32_t check_of(const hal::FaultRecord& record) {
  protocol::Crc32c crc;
  uint8_t bytes[20];
  protocol::put_u32(bytes, record.code);
  protocol::put_u64(bytes + 4, record.tick);
  protocol::put_u64(bytes + 12, record.arg);
  crc.add(protocol::ByteView{bytes, sizeof bytes});
  return crc.value();
}

void make_output(uint32_t pin) {
  reg(sio::gpio_out_clear) = 1U << pin;
  reg(sio::gpio_oe_set) = 1U << pin;
  reg(pads::pin(pin)) = pads::input_enable | pads::drive_4ma | pads::pull_down | pads::schmitt;
  reg(io::ctrl(pin)) = io::function_sio;
}

}  // namespace

void PicoWatchdog::begin() {
  make_output(kAlivePin);
  reg(psm::wdsel) = kWatchdogResets;
  reg(watchdog::load) = kWatchdogLoad;
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

hal::FaultRecord PicoFaultStore::load() const {
  return kept.check == check_of(kept.record) ? kept.record : hal::FaultRecord{};
}

void PicoFaultStore::save(const hal::FaultRecord& record) {
  kept.record = record;
  kept.check = check_of(record);
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
  reg(watchdog::scratch0) = 0;
  if ((reason & (kForced | kTimer)) != 0) {
    cause_ = asked_for ? hal::ResetCause::request : hal::ResetCause::watchdog;
  } else if ((chip & reset_chip::had_run_pin) != 0 && (chip & reset_chip::had_power_on) == 0) {
    cause_ = hal::ResetCause::pin;
  }
}

void PicoSystem::reboot(bool bootloader) {
  const uint32_t usb_boot = bootloader ? rom_function('U', 'B') : 0;
  if (usb_boot != 0) {
    using UsbBoot = void (*)(uint32_t activity_pins, uint32_t disabled_interfaces);
    reinterpret_cast<UsbBoot>(usb_boot)(1U << kLedPin, 0);  // NOLINT(performance-no-int-to-ptr)
  }
  reg(watchdog::scratch0) = kAskedFor;
  reg(watchdog::ctrl) = kWatchdogEnable | kWatchdogTrigger;
}

}  // namespace symrig::pico
