// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/types.hpp"

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

}  // namespace symrig::firmware
