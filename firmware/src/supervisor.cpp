// SPDX-License-Identifier: Apache-2.0
#include "symrig/firmware/supervisor.hpp"

namespace symrig::firmware {
namespace {

/// A Transition in a byte, because small boards keep the table in RAM: bit 0 allowed, bits 1-3 next, bits 4-6
/// actions.
using Cell = uint8_t;
static_assert(kStates <= 8, "three bits hold a state");

constexpr Cell kNo = 0;

constexpr Cell go(State next, uint8_t actions = action::none) {
  return static_cast<Cell>(1U | (static_cast<unsigned>(next) << 1U) | (static_cast<unsigned>(actions) << 4U));
}

constexpr uint8_t kSafe = action::force_safe;
constexpr uint8_t kUnload = action::drop_program;
constexpr uint8_t kForget = action::force_safe | action::drop_program | action::drop_config;

constexpr auto kBoot = State::boot;
constexpr auto kSafeState = State::safe;
constexpr auto kConfigured = State::configured;
constexpr auto kLoaded = State::loaded;
constexpr auto kArmed = State::armed;
constexpr auto kRunning = State::running;
constexpr auto kDone = State::done;
constexpr auto kFault = State::fault;

// clang-format off
// Rows: states in order of value. Columns: conditions in order of value, four a line:
//   boot_done      config_line    config_final   config_reset
//   program_begin  program_chunk  program_good   program_bad
//   arm            start          run_complete   run_cut
//   abort          host_lost      fault          clear_fault
//   manual_set     reboot
constexpr Cell kTable[kStates][kConditions] = {
  /* boot */
  {go(kSafeState, kSafe), kNo, kNo, kNo,
   kNo, kNo, kNo, kNo,
   kNo, kNo, kNo, kNo,
   go(kBoot, kSafe), go(kBoot), go(kFault, kSafe), kNo,
   kNo, kNo},
  /* safe */
  {kNo, go(kSafeState), go(kConfigured, kSafe), go(kSafeState, kForget),
   kNo, kNo, kNo, kNo,
   kNo, kNo, kNo, kNo,
   go(kSafeState, kSafe), go(kSafeState, kSafe), go(kFault, kSafe), kNo,
   kNo, go(kSafeState, kSafe)},
  /* configured */
  {kNo, go(kSafeState, kSafe | kUnload), kNo, go(kSafeState, kForget),
   go(kConfigured, kUnload), go(kConfigured), go(kLoaded), go(kConfigured, kUnload),
   kNo, kNo, kNo, kNo,
   go(kConfigured, kSafe), go(kConfigured, kSafe), go(kFault, kSafe), kNo,
   go(kConfigured), go(kConfigured, kSafe)},
  /* loaded */
  {kNo, go(kSafeState, kSafe | kUnload), kNo, go(kSafeState, kForget),
   go(kConfigured, kUnload), kNo, kNo, kNo,
   go(kArmed), kNo, kNo, kNo,
   go(kLoaded, kSafe), go(kLoaded, kSafe), go(kFault, kSafe), kNo,
   go(kLoaded), go(kLoaded, kSafe)},
  /* armed */
  {kNo, kNo, kNo, kNo,
   kNo, kNo, kNo, kNo,
   kNo, go(kRunning), kNo, kNo,
   go(kLoaded, kSafe), go(kFault, kSafe), go(kFault, kSafe), kNo,
   kNo, kNo},
  /* running */
  {kNo, kNo, kNo, kNo,
   kNo, kNo, kNo, kNo,
   kNo, kNo, go(kDone), go(kLoaded, kSafe),
   go(kLoaded, kSafe), go(kFault, kSafe), go(kFault, kSafe), kNo,
   kNo, kNo},
  /* done */
  {kNo, go(kSafeState, kSafe | kUnload), kNo, go(kSafeState, kForget),
   go(kConfigured, kUnload), kNo, kNo, kNo,
   go(kArmed), kNo, kNo, kNo,
   go(kLoaded, kSafe), go(kLoaded, kSafe), go(kFault, kSafe), kNo,
   go(kLoaded), go(kLoaded, kSafe)},
  /* fault: the first fault stays latched after any other condition */
  {kNo, kNo, kNo, kNo,
   kNo, kNo, kNo, kNo,
   kNo, kNo, kNo, kNo,
   go(kFault, kSafe), go(kFault, kSafe), go(kFault, kSafe), go(kSafeState, kForget),
   kNo, go(kFault, kSafe)},
};
// clang-format on

}  // namespace

Transition transition(State state, Condition condition) {
  const Cell cell = kTable[static_cast<unsigned>(state)][static_cast<unsigned>(condition)];
  if (cell == kNo) return {};
  return {true, static_cast<State>((cell >> 1U) & 7U), static_cast<uint8_t>(cell >> 4U)};
}

}  // namespace symrig::firmware
