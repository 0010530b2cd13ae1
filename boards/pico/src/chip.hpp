// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/peripherals.hpp"
#include "symrig/protocol/crc32c.hpp"

#include <stdint.h>  // NOLINT(modernize-deprecated-headers)

namespace symrig::pico {

/// Starts the 12 MHz crystal and the PLLs: clk_sys 125 MHz, clk_usb 48 MHz, 1 MHz for TIMER and watchdog.
/// Takes the peripherals in use out of reset.
void start_clocks();

/// A function of the boot ROM by its two-letter name; 0 if the ROM has none.
uint32_t rom_function(char first, char second);

/// A value that survives a reset, but not a loss of power. Put it into section .noinit. It has no
/// constructor: the compiler would call one at start-up and lose the value.
template <typename T>
class Kept {
 public:
  void save(const T& value) {
    __builtin_memcpy(words_, &value, sizeof value);
    words_[kWords] = check();
  }
  /// false: nothing is kept.
  bool load(T& value) const {
    if (words_[kWords] != check()) return false;
    __builtin_memcpy(&value, words_, sizeof value);
    return true;
  }
  void forget() { words_[kWords] = ~check(); }

 private:
  static constexpr uint32_t kWords = sizeof(T) / sizeof(uint32_t);
  static_assert(sizeof(T) % sizeof(uint32_t) == 0);

  uint32_t check() const {
    return protocol::crc32c({reinterpret_cast<const uint8_t*>(words_), sizeof(uint32_t) * kWords});
  }

  uint32_t words_[kWords + 1];
};

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
