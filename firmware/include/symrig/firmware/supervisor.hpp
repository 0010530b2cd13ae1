// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/clock.hpp"
#include "symrig/hal/peripherals.hpp"

namespace symrig::firmware {

/// Values are those of the wire. firmware/README.md describes each.
enum class State : uint8_t {
  boot = 0,
  safe = 1,
  configured = 2,
  loaded = 3,
  armed = 4,
  running = 5,
  done = 6,
  fault = 7
};
constexpr unsigned kStates = 8;

/// The requests and events that can change the state.
enum class Condition : uint8_t {
  boot_done,
  config_line,   ///< a line is (re)configured
  config_final,  ///< the configuration is complete and its hash matches
  config_reset,
  program_begin,
  program_chunk,
  program_good,  ///< committed
  program_bad,   ///< commit failed
  arm,
  start,
  run_complete,
  run_cut,    ///< a wait with on_timeout = abort timed out
  abort,      ///< requested by the host
  host_lost,  ///< the keep-alive expired, or the link closed
  fault,
  clear_fault,
  manual_set,  ///< levels by hand
  reboot       ///< requested by the host
};
constexpr unsigned kConditions = 18;

/// Actions of a transition. Bits of Transition::actions.
namespace action {
constexpr uint8_t none = 0;
constexpr uint8_t force_safe = 1;    ///< engine stopped, outputs to their safe levels
constexpr uint8_t drop_program = 2;  //
constexpr uint8_t drop_config = 4;   //
}  // namespace action

/// One cell of the table.
struct Transition {
  bool allowed = false;
  State next = State::fault;
  uint8_t actions = action::none;
};

/// The table: the transition of a state under a condition.
Transition transition(State state, Condition condition);

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
