// SPDX-License-Identifier: Apache-2.0
// How the engine notices the end of a wait, and ends waits that time out.
#include "board_pins.hpp"
#include "edge_engine.hpp"
#include "edge_machine.hpp"

namespace symrig::pico {

using hal::Tick;
using hal::WaitOutcome;
namespace code = edge_program;
namespace machine = edge_machine;

bool PicoEngine::pop_wait(WaitOutcome& outcome) {
  {
    const IrqHold hold(irq::timer0);
    settle();
    set_alarm();
  }
  if (first_outcome_ == first_wait_) return false;
  outcome = waits_[first_outcome_ % kWaits].outcome;
  first_outcome_ = first_outcome_ + 1;
  return true;
}

SYMRIG_RAM void PicoEngine::time_is_up() {
  settle();
  set_alarm();
}

/// Sets the alarm to the time-out of the oldest wait, or earlier. An early alarm is set again.
SYMRIG_RAM void PicoEngine::set_alarm() const {
  constexpr uint32_t kMost = 1U << 30U;
  if (!playing_ || !launched_ || first_wait_ == next_wait_) return;
  const Tick now = clock_.now();
  const Tick out_at = wait_begin() + waits_[first_wait_ % kWaits].wait.timeout;
  uint32_t ticks = 0;
  if (out_at > now) ticks = out_at - now < kMost ? static_cast<uint32_t>(out_at - now) : kMost;
  // Two more, because an alarm in the past never fires.
  reg(timer::alarm0) = reg(timer::raw_low) + ticks / kTicksPerMicrosecond + 2;
}

SYMRIG_RAM void PicoEngine::settle() {
  while (launched_ && first_wait_ != next_wait_ && settle_wait()) {
  }
}

/// true: the oldest wait has ended.
SYMRIG_RAM bool PicoEngine::settle_wait() {
  const Wait wait = waits_[first_wait_ % kWaits].wait;  // a copy, because its outcome replaces it
  const Tick now = clock_.now();
  if (pulled() > 2 * wait.segment + 2) {
    conclude_wait(edge_that_ended(wait));
    return true;
  }
  // The machine takes the next word kWaitLatency after the edge, so an older edge cannot have ended the wait.
  not_before_ = now - Tick{2} * kWaitLatency;
  const Tick out_at = wait_begin() + wait.timeout;
  return playing_ && now >= out_at && run_out(wait, out_at);
}

SYMRIG_RAM WaitOutcome PicoEngine::edge_that_ended(const Wait& wait) const {
  const Tick first_seen = wait_begin() + kWaitBlind;
  const Tick from = first_seen > not_before_ ? first_seen : not_before_;
  WaitOutcome outcome;
  if (!stampers_.find(wait.line - kFirstStampedLine, wait.rising, from, outcome.tick))
    outcome.tick = clock_.now();  // more edges have come than are stored
  outcome.resumed = outcome.tick + kWaitLatency;
  return outcome;
}

/// The wait has timed out. false: an edge came just in time.
SYMRIG_RAM bool PicoEngine::run_out(const Wait& wait, Tick when) {
  const IrqLock lock;
  if (!playing_) return false;
  machine::control(0);
  if (pulled() > 2 * wait.segment + 2) {
    machine::control(machine::kEnable);
    return false;
  }
  WaitOutcome outcome{when, 0, true};
  if (wait.stop) {
    machine::execute(code::kMovPinsX);
    outcome.resumed = clock_.now();
    played_at_stop_ = played();
    playing_ = false;
  } else {
    machine::control(machine::kRestart);  // cancels the waiting instruction
    machine::execute(code::jmp(code::kNext));
    outcome.resumed = clock_.at(machine::enable_timed()) + kEnableLatency;
  }
  conclude_wait(outcome);
  return true;
}

void PicoEngine::conclude_wait(const WaitOutcome& outcome) {
  waits_[first_wait_ % kWaits].outcome = outcome;
  anchor_ = outcome.resumed;
  not_before_ = 0;
  first_wait_ = first_wait_ + 1;
}

}  // namespace symrig::pico
