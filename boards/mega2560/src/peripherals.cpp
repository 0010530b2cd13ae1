// SPDX-License-Identifier: Apache-2.0
#include "peripherals.hpp"

#include "interrupts.hpp"

// MCUSR as it was at the reset.
extern "C" {
__attribute__((section(".noinit"), used)) uint8_t symrig_reset_flags;

/// Part of the start-up code, before main. The watchdog stays on over its own reset, at its shortest time
/// (data sheet 12.5.1), so it is switched off here. r1 is 0.
__attribute__((naked, used, section(".init3"))) void symrig_take_reset_flags() {
  asm volatile(
      "in r24, 0x34 \n sts symrig_reset_flags, r24 \n out 0x34, r1 \n"  // MCUSR
      "wdr \n ldi r24, 0x18 \n sts 0x60, r24 \n sts 0x60, r1");         // WDTCSR
}
}

namespace symrig::mega2560 {
namespace {

constexpr uint16_t kMagic = 0x5A17;
constexpr uint8_t kLed = 1U << 7U;     // PB7
constexpr uint8_t kTicksOfTimer4 = 7;  // a power of two: 1024 / 8

// Start-up clears neither. After a loss of power their content is random: the check words tell.
struct Kept {
  hal::FaultRecord record;
  uint32_t check;
};
__attribute__((section(".noinit"))) Kept kept;
__attribute__((section(".noinit"))) uint16_t asked;  // kMagic: the firmware itself asked for the reset

uint32_t check_word(const hal::FaultRecord& record) {
  const auto low = static_cast<uint32_t>(record.tick) ^ static_cast<uint32_t>(record.arg);
  const auto high = static_cast<uint32_t>(record.tick >> 32U) ^ static_cast<uint32_t>(record.arg >> 32U);
  return ~(record.code ^ low ^ (high << 1U)) ^ kMagic;
}

}  // namespace

void MegaWatchdog::begin() {
  TCCR4A = 0;
  TCCR4B = (1U << CS42) | (1U << CS40);  // clk/1024
  apart_ = apart();
  set_watchdog(kWatchdog250Ms);
}

uint16_t MegaWatchdog::apart() const {
  const IrqLock lock;
  const uint16_t second = TCNT4;
  return static_cast<uint16_t>(second - static_cast<uint16_t>(clock_.now_locked() >> kTicksOfTimer4));
}

void MegaWatchdog::feed() {
  const auto lost = static_cast<uint16_t>(apart() - apart_);
  if (static_cast<uint16_t>(lost + 1) <= 2) feed_watchdog();  // -1 to 1
}

hal::FaultRecord MegaFaultStore::load() const {
  return kept.check == check_word(kept.record) ? kept.record : hal::FaultRecord{};
}

void MegaFaultStore::save(const hal::FaultRecord& record) {
  kept.record = record;
  kept.check = check_word(record);
}

void MegaIndicator::begin() {
  DDRB |= kLed;
}

void MegaIndicator::show(bool on) {
  PORTB = on ? kLed : 0;
}

void MegaSystem::begin() {
  const bool power = (symrig_reset_flags & ((1U << PORF) | (1U << BORF))) != 0;
  const bool watchdog = (symrig_reset_flags & (1U << WDRF)) != 0;
  const hal::ResetCause dog = asked == kMagic ? hal::ResetCause::request : hal::ResetCause::watchdog;
  cause_ = watchdog ? dog : hal::ResetCause::pin;
  if (power) cause_ = hal::ResetCause::power;
  asked = 0;
}

void MegaSystem::reboot(bool /*bootloader*/) {
  cli();
  asked = kMagic;
  set_watchdog(kWatchdog16Ms);
  for (;;) {
  }
}

}  // namespace symrig::mega2560
