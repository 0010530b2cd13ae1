// SPDX-License-Identifier: Apache-2.0
// The end of a program that went wrong, and what it leaves behind.
#include "board_pins.hpp"
#include "chip.hpp"
#include "registers.hpp"

extern "C" {
extern uint32_t __stack_guard, __stack_bottom, __stack_top;  // NOLINT
}

namespace symrig::pico {
namespace {

__attribute__((section(".noinit"))) Kept<hal::Crash> kept;

constexpr uint32_t kUnused = 0x5ac1'5ac1;  // in stack that was never used

}  // namespace

void release_pins() {
  for (uint32_t pin = 0; pin < kOutputs; ++pin) reg(io::ctrl(pin)) = io::function_none;
  reg(io::ctrl(kAlivePin)) = io::function_none;
}

void keep_crash(const ExceptionFrame& frame, uint32_t exception) {
  hal::Crash crash{exception, frame.pc, frame.lr, frame.psr, address_of(&frame + 1), {}};
  for (uint32_t i = 0; i < 5; ++i) crash.r[i] = frame.r[i];
  kept.save(crash);
}

void forget_crash() {
  kept.forget();
}

void stop_board() {
  release_pins();
  asm volatile("cpsid i" ::: "memory");
  reg(watchdog::ctrl) = 1U << 31U;
  for (;;) asm volatile("");
}

const hal::Crash& last_crash() {
  static hal::Crash last;
  static bool read = false;
  if (!read) kept.load(last);
  read = true;
  return last;
}

/// Region 0 of the memory protection unit: no access. The hard fault handler is exempt.
void guard_stack() {
  constexpr uint32_t kValid = 1U << 4U;
  constexpr uint32_t kNeverRun = 1U << 28U;
  constexpr uint32_t kSize256 = 7U << 1U;
  constexpr uint32_t kDefaultMap = 1U << 2U;
  reg(core::mpu_base) = address_of(&__stack_guard) | kValid;
  reg(core::mpu_attributes) = kNeverRun | kSize256 | 1U;
  reg(core::mpu_ctrl) = kDefaultMap | 1U;
  asm volatile("dsb\n isb" ::: "memory");
}

void fill_stack() {
  constexpr uint32_t kInUse = 256;  // bytes
  volatile uint32_t* at = &__stack_bottom;
  while (address_of(at) < address_of(&__stack_top) - kInUse) *at++ = kUnused;
}

uint32_t stack_free() {
  const volatile uint32_t* at = &__stack_bottom;
  while (at < &__stack_top && *at == kUnused) ++at;
  return address_of(at) - address_of(&__stack_bottom);
}

}  // namespace symrig::pico
