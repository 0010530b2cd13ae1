// SPDX-License-Identifier: Apache-2.0
#include "board_pins.hpp"
#include "edge_engine.hpp"
#include "edge_program.hpp"

namespace symrig::pico::edge_machine {

SYMRIG_RAM void write_count_down(uint32_t reference, uint32_t count) {
  uint32_t passed = 0;
  asm volatile(
      "ldr  %[passed], [%[systick]]\n"
      "subs %[passed], %[reference], %[passed]\n"
      "lsls %[passed], %[passed], #8\n"
      "lsrs %[passed], %[passed], #8\n"
      "subs %[passed], %[count], %[passed]\n"
      "str  %[passed], [%[queue]]\n"
      : [passed] "=&l"(passed)
      : [systick] "l"(core::systick), [reference] "l"(reference), [count] "l"(count),
        [queue] "l"(pio::pio0 + pio::txf0)
      : "cc", "memory");
}

SYMRIG_RAM uint32_t enable_timed() {
  uint32_t stood = 0;
  asm volatile(
      "ldr %[stood], [%[systick]]\n"
      "str %[enable], [%[control]]\n"
      : [stood] "=&l"(stood)
      : [systick] "l"(core::systick), [control] "l"(pio::pio0 + pio::ctrl), [enable] "l"(1)
      : "memory");
  return stood;
}

}  // namespace symrig::pico::edge_machine

// How the engine notices the end of a wait, and ends waits that time out.

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
  const uint32_t alarm = reg(timer::raw_low) + ticks / kTicksPerMicrosecond + 1;
  reg(timer::alarm0) = alarm;
  // An alarm in the past never fires, and a trip's interrupt may have passed here meanwhile.
  if (static_cast<int32_t>(alarm - reg(timer::raw_low)) <= 0) reg(core::irq_set_pending) = 1U << irq::timer0;
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

/// What changes when the machine takes a word (and when DMA brings one).
SYMRIG_RAM uint32_t PicoEngine::intake() {
  return (reg(pio::pio0 + pio::flevel) & 0xfU) | SegmentRing::place() << 4U;
}

/// The wait has timed out. false: an edge came just in time, or DMA is bringing words; the caller tries
/// again.
SYMRIG_RAM bool PicoEngine::run_out(const Wait& wait, Tick when) {
  const uint32_t before = intake();
  if (pulled() > 2 * wait.segment + 2) return false;
  const uint64_t words = played();
  uint32_t stood = 0;
  if (!end_wait(before, wait.stop, stood)) return false;
  WaitOutcome outcome{when, 0, true};
  outcome.resumed = wait.stop ? clock_.now() : clock_.at(stood) + kEnableLatency;
  if (wait.stop) played_at_stop_ = words;
  conclude_wait(outcome);
  return true;
}

/// With interrupts off for a few cycles only, because a trip must not wait. Goes on with the next word, or
/// stops at the safe word. stood: SysTick a fixed number of cycles before the machine goes on.
SYMRIG_RAM bool PicoEngine::end_wait(uint32_t intake_before, bool stop, uint32_t& stood) {
  const IrqLock lock;
  if (!playing_) return false;
  machine::control(0);
  if (intake() != intake_before) {
    machine::control(machine::kEnable);
    return false;
  }
  if (stop) {
    machine::execute(code::kMovPinsX);
    playing_ = false;
    return true;
  }
  machine::control(machine::kRestart);  // cancels the waiting instruction
  machine::execute(code::jmp(code::kNext));
  stood = machine::enable_timed();
  return true;
}

void PicoEngine::conclude_wait(const WaitOutcome& outcome) {
  waits_[first_wait_ % kWaits].outcome = outcome;
  anchor_ = outcome.resumed;
  not_before_ = 0;
  first_wait_ = first_wait_ + 1;
}

}  // namespace symrig::pico
