// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/firmware/supervisor.hpp"
#include "symrig/hal/indicator.hpp"

namespace symrig::firmware {

/// Shows the state with the board's light: its period and how long it is on in each period. The table is in
/// docs and in each board's page.
class Beacon {
 public:
  Beacon(hal::Indicator& indicator, uint64_t tick_hz) : indicator_(indicator), ms_(tick_hz / 1000) {}

  /// Blinks fast until `tick` in any state, so that a person can find this board.
  void identify_until(hal::Tick tick) { identify_until_ = tick; }
  void show(State state, hal::Tick now) {
    const Rhythm& rhythm = now < identify_until_ ? kIdentify : kRhythms[static_cast<unsigned>(state)];
    indicator_.show(now / ms_ % rhythm.period_ms < rhythm.on_ms);
  }
  /// While the board identifies itself, the light must change on time. Otherwise it may change late.
  hal::Tick next_deadline(hal::Tick now) const {
    if (now >= identify_until_) return hal::kNever;
    const hal::Tick half = ms_ * kIdentify.on_ms;
    return (now / half + 1) * half;
  }

 private:
  struct Rhythm {
    uint16_t period_ms;
    uint16_t on_ms;
  };
  static constexpr Rhythm kIdentify{100, 50};
  static constexpr Rhythm kRhythms[kStates] = {
      {1000, 1000},  // boot
      {2000, 100},   // safe: a flash every two seconds
      {2000, 1000},  // configured
      {1000, 500},   // loaded
      {500, 250},    // armed
      {1000, 1000},  // running: steady
      {1000, 500},   // done, as loaded
      {200, 100},    // fault
  };

  hal::Indicator& indicator_;
  uint64_t ms_;
  hal::Tick identify_until_ = 0;
};

}  // namespace symrig::firmware
