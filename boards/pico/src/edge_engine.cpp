// SPDX-License-Identifier: Apache-2.0
#include "edge_engine.hpp"

#include "board_pins.hpp"
#include "edge_program.hpp"
#include "stampers.hpp"

namespace symrig::pico {

using hal::Segment;
using hal::Tick;
using hal::Until;
namespace code = edge_program;
namespace machine = edge_machine;

namespace {

constexpr uint32_t kLaunchLead = 500;  // delay of a start "now": time to fill the queue
constexpr Tick kFarAway = 1U << 30U;   // firmware delays a start that is later than this

}  // namespace

void PicoEngine::begin(PinWatch& pins) {
  pins_ = &pins;
  for (uint32_t i = 0; i < code::kCodeSize; ++i) reg(pio::pio0 + pio::instr_mem + 4 * i) = code::kCode[i];
  reg(pio::pio0 + pio::clkdiv) = 1U << 16U;
  reg(pio::pio0 + pio::execctrl) = (code::kWrapTop << 12U) | (code::kNext << 7U);
  reg(pio::pio0 + pio::shiftctrl) = (1U << 30U) | (1U << 19U);  // TX FIFO of 8; OSR shifts right
  reg(pio::pio0 + pio::pinctrl) = kOutputs << 20U;
  ring_.reset();
  set_safe(0);
  put_out(0);
  machine::pull_in(kOutputMask);
  machine::execute(code::kOutPinDirections);
  for (uint32_t pin = 0; pin < kOutputs; ++pin)
    reg(pads::pin(pin)) = pads::input_enable | pads::drive_4ma | pads::pull_down | pads::schmitt;
  reg(pio::pio0 + pio::irq0_inte) = (machine::kEndFlag | machine::kHaltFlag) << 8U;
}

SYMRIG_RAM size_t PicoEngine::room() const {
  if (!playing_ && !fresh_)
    return ended_ ? SegmentRing::kCapacity - 1 : 0;  // 0: after a fall, segments are not wanted
  const uint32_t used = ring_.used();
  return used + 1 < SegmentRing::kCapacity ? SegmentRing::kCapacity - 1 - used
                                           : 0;  // one slot is for the end
}

SYMRIG_RAM void PicoEngine::push(const Segment& segment) {
  if (!playing_ && !fresh_) {
    if (!ended_) return;  // fell to safe levels just now; the caller does not know yet
    forget_queue();
  }
  if (segment.until == Until::elapsed) {
    last_levels_ = segment.levels & kOutputMask;
    ring_.write(code::first_word(last_levels_, code::kDwell), code::dwell_word(segment.ticks));
    offset_ += segment.ticks;
  } else {
    const bool rising = segment.until == Until::rising;
    ring_.write(code::first_word(last_levels_, code::kWait),
                code::wait_word(rising, kLinePins[segment.line]));
    waits_[next_wait_ % kWaits].wait = {pushed_,      offset_, segment.ticks,
                                        segment.line, rising,  segment.stop_on_timeout};
    asm volatile("" ::: "memory");  // from here on an interrupt may read it
    next_wait_ = next_wait_ + 1;
    offset_ = 0;
  }
  ++pushed_;
}

void PicoEngine::close() {
  ring_.write(code::first_word(last_levels_, code::kEnd), 0);
  ring_.grant();
  closed_ = true;
}

Tick PicoEngine::start(Tick tick) {
  const uint32_t at_trip = lines_at_trip();
  if (at_trip != 0) {
    trip(at_trip);
    return clock_.now();
  }
  ring_.grant();
  return make_ready(tick) ? launch_when_near(tick) : clock_.now();
}

/// The machine waits at `pull` until launch() gives it a count. false: it must not start.
SYMRIG_RAM bool PicoEngine::make_ready(Tick tick) {
  fallen_at_ = clock_.now();
  const IrqLock lock;
  fallen_ = held_;
  if (must_be_safe()) return false;
  machine::control(machine::kRestart);
  machine::execute(code::jmp(code::kDwell));
  reg(pio::pio0 + pio::irq) = machine::kEndFlag | machine::kHaltFlag;
  underrun_ = false;
  ended_ = false;
  played_at_stop_ = 0;
  launched_ = false;
  launch_at_ = tick;
  playing_ = true;
  fresh_ = false;
  machine::control(machine::kEnable);
  return true;
}

Tick PicoEngine::launch_when_near(Tick tick) {
  const Tick now = clock_.now();
  if (tick > now && tick - now > kFarAway) return tick;
  launch();
  return anchor_;
}

/// The first word goes out at launch_at_, or kLaunchLead from now if that is later. The calculation runs with
/// interrupts on, for trips; if they take too long, it begins again.
SYMRIG_RAM void PicoEngine::launch() {
  constexpr uint32_t kNeeded = 100;  // ticks from the check below to the write
  uint32_t reference = 0;
  do {
    reference = read_systick();
    const Tick now = clock_.at(reference);
    anchor_ = launch_at_ > now + kLaunchLead ? launch_at_ : now + kLaunchLead;
    launch_count_ = static_cast<uint32_t>(anchor_ - now) - kLaunchLatency;
  } while (!launch_in_time(reference, kLaunchLead - kNeeded));
  set_alarm();
}

/// false: more than `most` ticks have passed since SysTick had the value `reference`.
SYMRIG_RAM bool PicoEngine::launch_in_time(uint32_t reference, uint32_t most) {
  const IrqLock lock;
  if (!playing_) return true;  // it fell in the meantime
  if (((reference - read_systick()) & kSystickMask) > most) return false;
  machine::write_count_down(reference, launch_count_);
  ring_.open();
  reg(pio::pio0 + pio::fdebug) = machine::kStalled;
  not_before_ = 0;
  launched_ = true;
  return true;
}

/// A run ends only after its last edges have been checked, because limits and receipts need them.
bool PicoEngine::idle() const {
  if (playing_ || fallen_) return false;
  return !ended_ || pins_->caught_up() >= ended_at_;
}

uint32_t PicoEngine::levels() const {
  return reg(pio::pio0 + pio::padout) & kOutputMask;
}

bool PicoEngine::underrun() const {
  return underrun_;
}

/// Words that the machine has taken: those that DMA has read, minus those in the queue. DMA may have read
/// words that it has not written yet; that takes less than the 16 cycles of the wait here. A word that moves
/// meanwhile makes the result smaller by one, never larger.
SYMRIG_RAM uint64_t PicoEngine::pulled() const {
  const uint64_t read = ring_.read_words();
  asm volatile("nop; nop; nop; nop; nop; nop; nop; nop; nop; nop; nop; nop; nop; nop; nop; nop");
  const uint32_t standing = reg(pio::pio0 + pio::flevel) & 0xfU;
  return read > standing ? read - standing : 0;
}

uint64_t PicoEngine::played() const {
  if (!playing_) return played_at_stop_;
  if (!launched_) return 0;
  uint64_t begun = (pulled() + 1) / 2;
  if (begun > pushed_) begun = pushed_;  // the end marker is not a word
  uint32_t waits = first_wait_;
  while (waits != next_wait_ && waits_[waits % kWaits].wait.segment < begun) ++waits;
  return begun - waits;
}

/// Outputs first.
SYMRIG_RAM void PicoEngine::halt_machine() {
  machine::control(0);
  machine::execute(code::kMovPinsX);
}

SYMRIG_RAM void PicoEngine::trip(uint32_t lines) {
  halt_machine();
  tripped_ = tripped_ | lines;
  if (!playing_) return;
  played_at_stop_ = played();
  playing_ = false;
}

SYMRIG_RAM void PicoEngine::fall() {
  halt_machine();
  held_ = true;
  if (!playing_) return;
  played_at_stop_ = played();
  playing_ = false;
  fallen_at_ = clock_.now();
  fallen_ = true;
}

SYMRIG_RAM void PicoEngine::release() {
  held_ = false;
  fallen_at_ = clock_.now();
}

SYMRIG_RAM void PicoEngine::program_stopped() {
  const uint32_t flags = reg(pio::pio0 + pio::irq) & (machine::kEndFlag | machine::kHaltFlag);
  reg(pio::pio0 + pio::irq) = flags;
  if (!playing_ || flags == 0) return;
  played_at_stop_ = played();
  underrun_ = (flags & machine::kHaltFlag) != 0;
  ended_ = !underrun_;
  ended_at_ = clock_.now();
  playing_ = false;
}

void PicoEngine::force(uint32_t levels) {
  {
    const IrqLock lock;
    machine::control(0);
    if ((levels & kOutputMask) == safe_) machine::execute(code::kMovPinsX);
    if (playing_) played_at_stop_ = played();
    playing_ = false;
    underrun_ = false;
    fallen_ = false;
  }
  forget_queue();
  const IrqLock lock;  // an interrupt that makes the outputs safe comes before this, or after it
  put_out(must_be_safe() ? safe_ : levels & kOutputMask);
  if (!connected_) connect_pins();
}

/// Until then the pins are inputs, as in reset. The stored safe levels are not known before: a line that is
/// safe at high would go low at each start.
void PicoEngine::connect_pins() {
  for (uint32_t pin = 0; pin < kOutputs; ++pin) reg(io::ctrl(pin)) = io::function_pio0;
  connected_ = true;
}

/// Only while the machine is stopped with an empty queue.
void PicoEngine::put_out(uint32_t levels) {
  machine::pull_in(levels);
  machine::execute(code::kOutPins27);
  last_levels_ = levels;
}

void PicoEngine::forget_queue() {
  launched_ = false;
  machine::control(machine::kRestart);
  ring_.reset();
  for (uint32_t i = 0; i < machine::kQueueDepth; ++i) machine::execute(code::kPullOrX);
  first_wait_ = 0;
  next_wait_ = 0;
  first_outcome_ = 0;
  pushed_ = 0;
  offset_ = 0;
  closed_ = false;
  fresh_ = true;
}

void PicoEngine::set_safe(uint32_t levels) {
  safe_ = levels & kOutputMask;
  if (playing_) return;  // the core changes it only at rest
  forget_queue();
  machine::pull_in(code::first_word(safe_, code::kHalt));
  machine::execute(code::kMovXOsr);
}

void PicoEngine::set_trips(uint32_t lines, uint32_t levels) {
  {
    const IrqLock lock;
    trip_lines_ = lines;
    trip_levels_ = levels;
    tripped_ = tripped_ & lines;
  }
  pins_->watch_trips(lines, levels);
  const uint32_t now = lines_at_trip();
  if (now != 0) trip(now);
}

uint32_t PicoEngine::lines_at_trip() const {
  return trip_lines_ & ~(line_levels() ^ trip_levels_);
}

void PicoEngine::service() {
  if (fallen_ && !held_ && clock_.now() - fallen_at_ > kPatience) {
    underrun_ = true;
    fallen_ = false;
  }
  if (!playing_) return;
  if (!launched_) {
    if (launch_at_ <= clock_.now() + kFarAway) launch();
    return;
  }
  ring_.service();
  if ((reg(pio::pio0 + pio::fdebug) & machine::kOverflow) != 0) {
    reg(pio::pio0 + pio::fdebug) = machine::kOverflow;
    ++overflows_;
  }
  if ((reg(pio::pio0 + pio::fdebug) & machine::kStalled) != 0 && playing_) {
    const IrqLock lock;
    halt_machine();
    played_at_stop_ = played();
    underrun_ = true;
    playing_ = false;
  }
  const IrqHold hold(irq::timer0);
  settle();
  set_alarm();
}

Tick PicoEngine::next_deadline() const {
  if (!playing_) return hal::kNever;
  return launched_ ? hal::kNever : launch_at_ - kFarAway;
}

}  // namespace symrig::pico
