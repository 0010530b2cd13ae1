// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "interrupts.hpp"
#include "symrig/hal/edge_engine.hpp"
#include "tick_clock.hpp"

namespace symrig::mega2560 {

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
