// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/diagnostics.hpp"

namespace symrig::pico {

/// What an exception pushes to the stack (ARMv6-M Architecture Reference Manual, B1.5.6).
struct ExceptionFrame {
  uint32_t r[5];  // r0 to r3, r12
  uint32_t lr;
  uint32_t pc;
  uint32_t psr;
};

constexpr uint32_t kSysTickException = 15;

/// The outputs and `alive` become inputs; resistors pull them down.
void release_pins();
/// Keeps the interrupted program's registers over the next reset. exception: the number of the caller's
/// exception.
void keep_crash(const ExceptionFrame& frame, uint32_t exception);
/// Forgets what keep_crash() kept since the last reset: the program went on.
void forget_crash();
/// Releases the pins and resets the board at once.
[[noreturn]] void stop_board();
/// The crash before this start; exception 0: none. Reads it on the first call.
const hal::Crash& last_crash();
/// From now on, a stack that grows beyond its room is a hard fault.
void guard_stack();
/// Bytes of the stack that were never used. fill_stack() must have run first.
uint32_t stack_free();
void fill_stack();

}  // namespace symrig::pico
