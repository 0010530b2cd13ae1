// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/edge_engine.hpp"
#include "tick_clock.hpp"

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

/// Edges of outputs and inputs. Interrupts add them in order of time; the firmware takes them.
class EdgeLog final : public hal::Capture {
 public:
  EdgeLog(const TickClock& clock, InputGate& gate) : clock_(clock), gate_(gate) {}

  uint32_t levels() const override { return output_levels() | (uint32_t{input_levels()} << kOutputs); }
  bool pop(hal::CapturedEdge& edge) override;
  bool take_overflow() override;
  uint32_t take_chatter() override;
  void watch(uint32_t lines) override;

  /// How many edges were added, modulo 256.
  uint8_t added() const { return put_; }
  /// True if as many as added() was then have been taken. At most kRoom can be missing.
  bool taken_until(uint8_t added) const { return static_cast<uint8_t>(added - taken_ - 1) >= kRoom; }
  /// Inputs that chattered are taken again. Call it with interrupts off.
  void take_all_inputs() { gate_.open(); }
  /// Call it with interrupts off.
  __attribute__((always_inline)) void add(ShortTick tick, uint8_t line, bool level) {
    if (((watched_ >> line) & 1U) == 0) return;
    if (static_cast<uint8_t>(put_ - taken_) == kRoom) {
      overflow_ = true;
      return;
    }
    slots_[put_ % kRoom] = {tick, static_cast<uint8_t>(line | (level ? kHigh : 0U))};
    put_ = static_cast<uint8_t>(put_ + 1);
  }
  /// The same for each line in `changed`, outputs only.
  void add_changes(ShortTick tick, uint8_t changed, uint8_t levels) {
    for (uint8_t k = 0; changed != 0; ++k, changed = static_cast<uint8_t>(changed >> 1U))
      if ((changed & 1U) != 0) add(tick, k, ((levels >> k) & 1U) != 0);
  }

 private:
  static constexpr uint8_t kRoom = 16;
  static constexpr uint8_t kHigh = 0x80;
  struct Slot {
    ShortTick tick;
    uint8_t line;
  };

  const TickClock& clock_;
  InputGate& gate_;
  Slot slots_[kRoom] = {};
  volatile uint8_t put_ = 0;
  volatile uint8_t taken_ = 0;
  volatile uint16_t watched_ = 0xFFFF;
  volatile bool overflow_ = false;
};

}  // namespace symrig::mega2560
