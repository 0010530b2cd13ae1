// SPDX-License-Identifier: Apache-2.0
// The lines, the interrupts of the inputs, and a lock against all interrupts.
#pragma once

#include "tick_clock.hpp"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <stdint.h>  // NOLINT(modernize-deprecated-headers)

namespace symrig::mega2560 {

// Lines 0 to 5 are PA0 to PA5: one store sets all outputs. Lines 6 to 11 are inputs with an interrupt each:
// INT0 to INT3 (PD0 to PD3), INT4 and INT5 (PE4, PE5).
constexpr uint8_t kOutputs = 6;
constexpr uint8_t kLines = 12;
constexpr uint8_t kOutputMask = 0x3F;

/// Present levels of the inputs: bit k is line kOutputs + k.
inline uint8_t input_levels() {
  return static_cast<uint8_t>((PIND & 0x0FU) | (PINE & 0x30U));
}
/// Present level of one input.
template <uint8_t input>
inline bool input_level() {
  return ((input < 4 ? PIND : PINE) & (1U << input)) != 0;
}
/// Present levels of the output pins, bit k is line k.
inline uint8_t output_levels() {
  return PINA & kOutputMask;
}

/// The interrupts of the inputs. One that comes too often would leave no time for anything else: an edge
/// costs 16 us. So an input with more than kMost edges in a window of 1.024 ms gets no interrupt until the
/// clock's next overflow, 33 ms at most.
///
/// All inputs together then take at most kInputs * kMost * 16 us of each 1024 us, 0.56 of the time.
class InputGate {
 public:
  static constexpr uint8_t kInputs = kLines - kOutputs;
  static constexpr uint8_t kAll = (1U << kInputs) - 1;
  static constexpr uint8_t kMost = 6;

  /// Inputs have pull-ups: an open wire reads high. Each edge gives an interrupt.
  static void begin() {
    PORTD |= 0x0FU;
    PORTE |= 0x30U;
    EICRA = 0x55;  // INT0 to INT3: any edge
    EICRB = 0x05;  // INT4, INT5: any edge
    EIFR = kAll;
    EIMSK = kAll;
  }

  /// An edge of this input, from its interrupt. An interlock that is watched has tripped then, so it may be
  /// closed too: the outputs stay safe until it is watched again.
  template <uint8_t input>
  __attribute__((always_inline)) void count(ShortTick tick) {
    const auto window = static_cast<uint8_t>(static_cast<uint8_t>(tick >> 8U) >> 3U);
    if (window != windows_[input]) {
      windows_[input] = window;
      counts_[input] = 0;
    }
    if (++counts_[input] <= kMost) return;
    EIMSK &= static_cast<uint8_t>(~(1U << input));
    closed_ = static_cast<uint8_t>(closed_ | (1U << input));
  }

  /// All inputs get their interrupts again. Those that had none miss their edges until now. Call it with
  /// interrupts off, and before each second time that the clock is in the same window.
  void open() {
    const auto shut = static_cast<uint8_t>(~EIMSK & kAll);
    for (uint8_t& count : counts_) count = 0;
    if (shut == 0) return;
    EIFR = shut;
    EIMSK = kAll;
  }

  /// The inputs that were closed since the last call. Call it with interrupts off.
  uint8_t take_closed() {
    const uint8_t closed = closed_;
    closed_ = 0;
    return closed;
  }

 private:
  uint8_t windows_[kInputs] = {};
  uint8_t counts_[kInputs] = {};
  uint8_t closed_ = 0;
};

/// No interrupt comes while it lives.
class IrqLock {
 public:
  IrqLock() : status_(SREG) {
    cli();
    asm volatile("" ::: "memory");
  }
  ~IrqLock() {
    asm volatile("" ::: "memory");
    SREG = status_;
  }
  IrqLock(const IrqLock&) = delete;
  IrqLock& operator=(const IrqLock&) = delete;

 private:
  uint8_t status_;
};

}  // namespace symrig::mega2560
