// SPDX-License-Identifier: Apache-2.0
#include "edge_engine.hpp"

#include "interrupts.hpp"

namespace symrig::mega2560 {

using hal::Tick;
using hal::Until;

namespace {

constexpr uint16_t kFar = 0x7000;               // ticks that the alarm waits at most before it looks again
constexpr uint16_t kSoon = 16;                  // the shortest alarm
constexpr hal::Tick kFarAway = 1UL << 30U;      // a start that is later than this waits in 64 bits
constexpr uint16_t kSetting = 8;                // ticks that setting the alarm takes
constexpr uint16_t kStart = kLead + 6 * kSoon;  // from start() to the first word of a start that is due now

}  // namespace

void MegaEngine::begin() {
  TCCR1A = 0;
  TCCR1B = 1U << CS11;  // clk/8, as the clock
  TIFR1 = 1U << OCF1A;
  TIMSK1 = 1U << OCIE1A;
}

size_t MegaEngine::room() const {
  return static_cast<size_t>(kQueueSegments - used());
}

void MegaEngine::push(const hal::Segment& segment) {
  const uint8_t line = segment.until == Until::elapsed ? 0 : static_cast<uint8_t>(segment.line - kOutputs);
  slots_[put_ % kSlots] = {segment.ticks, static_cast<uint8_t>(segment.levels & kOutputMask), segment.until,
                           static_cast<uint8_t>(line | (segment.stop_on_timeout ? kStop : 0U))};
  const IrqLock lock;
  put_ = static_cast<uint8_t>(put_ + 1);
  closed_ = false;
}

void MegaEngine::close() {
  closed_ = true;
}

Tick MegaEngine::start(Tick tick) {
  const Tick soonest = clock_.now() + kStart;
  const Tick begin = tick < soonest ? soonest : tick;
  const bool far = begin - soonest > kFarAway;
  const IrqLock lock;
  underrun_ = false;
  waiting_ = false;
  played_ = 0;
  late_ = 0;
  outcomes_taken_ = outcomes_put_;
  next_ = static_cast<ShortTick>(begin);
  begin_ = begin;
  if (tripped_ != 0) {
    stop_safe();
  } else {
    playing_ = true;
    far_ = far;
    set_alarm();
  }
  return begin;
}

uint64_t MegaEngine::played() const {
  const IrqLock lock;
  return played_;
}

uint32_t MegaEngine::late() const {
  const IrqLock lock;
  return late_;
}

bool MegaEngine::pop_wait(hal::WaitOutcome& outcome) {
  Outcome ended{};
  {
    const IrqLock lock;
    if (outcomes_put_ == outcomes_taken_) return false;
    ended = outcomes_[outcomes_taken_ % kSlots];
    outcomes_taken_ = static_cast<uint8_t>(outcomes_taken_ + 1);
  }
  // The next word can still be ahead: extend() is for ticks that have passed.
  const Tick tick = clock_.extend(ended.tick);
  outcome = {tick, tick + static_cast<ShortTick>(ended.resumed - ended.tick), ended.timed_out};
  return true;
}

void MegaEngine::force(uint32_t levels) {
  const IrqLock lock;
  stop();
  underrun_ = false;
  closed_ = false;
  put(tripped_ != 0 ? safe_ : static_cast<uint8_t>(levels & kOutputMask));
}

void MegaEngine::set_safe(uint32_t levels) {
  const IrqLock lock;
  safe_ = static_cast<uint8_t>(levels & kOutputMask);
}

void MegaEngine::set_trips(uint32_t lines, uint32_t levels) {
  const IrqLock lock;
  trip_lines_ = static_cast<uint8_t>(lines >> kOutputs);
  trip_levels_ = static_cast<uint8_t>(levels >> kOutputs);
  tripped_ = static_cast<uint8_t>(tripped_ & trip_lines_);
  log_.take_all_inputs();
  // An edge whose interrupt is still to come counts, whatever the level is by now.
  look_for_trips(static_cast<uint8_t>(EIFR | ~(input_levels() ^ trip_levels_)));
}

/// Wakes kLead ticks before next_, after kFar ticks, or at once, whichever is first. Timer 1 counts from 0
/// each time, so the compare value is always ahead. Call it with interrupts off.
void MegaEngine::set_alarm() const {
  const ShortTick now = clock_.now_locked();
  const ShortTick wake = next_ - kLead - kSetting;
  uint16_t wait = far_ ? kFar : kSoon;
  if (!far_ && before(now + kSoon, wake)) wait = wake - now < kFar ? static_cast<uint16_t>(wake - now) : kFar;
  TCNT1 = 0;
  OCR1A = wait;
  TIFR1 = 1U << OCF1A;
}

/// Interrupts are off meanwhile. So it stops waiting if an interlock line changes: false.
bool MegaEngine::wait_for_tick(ShortTick tick) const {
  const auto low = static_cast<uint16_t>(tick);
  const uint8_t watched = trip_lines_;  // the flag of INTk is bit k, as input k
  while (static_cast<int16_t>(static_cast<uint16_t>(TickClock::count() - low)) < 0)
    if ((EIFR & watched) != 0) return false;
  return true;
}

void MegaEngine::time_is_up() {
  if (!playing_) return;
  far_ = far_ && starts_far_away();
  const ShortTick now = clock_.now_locked();
  if (!far_ && before(next_, now + kLead + kSetting + kSoon)) act();
  if (playing_) set_alarm();
}

/// Ticks are compared by 32 bits, so a start may be too far ahead for that.
bool MegaEngine::starts_far_away() const {
  const Tick now = clock_.long_now_locked();
  return begin_ > now && begin_ - now > kFarAway;
}

/// The next word, the end of a wait, or the end of the run.
void MegaEngine::act() {
  const bool dry = put_ == taken_;
  const Slot& slot = slots_[taken_ % kSlots];
  if (!waiting_ && !dry && slot.until == Until::elapsed) return play(slot);
  if (!wait_for_tick(next_)) return;
  if (waiting_) return end_wait(next_, true);
  if (dry) return run_dry();
  taken_ = static_cast<uint8_t>(taken_ + 1);
  begin_wait(slot);
}

/// Everything that can be done before the tick is done before it. A word that is later than its own end would
/// be a shorter pulse than planned. It counts as an underrun.
void MegaEngine::play(const Slot& slot) {
  const ShortTick end = next_ + slot.ticks;
  const uint8_t levels = slot.levels;
  if (!before(clock_.now_locked(), end)) {
    underrun_ = true;
    return stop_safe();
  }
  if (!wait_for_tick(next_)) return;
  PORTA = levels;
  const auto late = static_cast<uint16_t>(TickClock::count() - static_cast<uint16_t>(next_));
  shown(levels, next_ + late);
  taken_ = static_cast<uint8_t>(taken_ + 1);
  ++played_;
  if (late > kLateness && late_ != UINT16_MAX) ++late_;
  next_ = end;
}

void MegaEngine::run_dry() {
  playing_ = false;
  underrun_ = !closed_;
  if (underrun_) return stop_safe();
  log_end_ = log_.added();
  log_read_ = false;
}

/// A run ends only after its last edges have been taken from the log: events are in order of time, and limits
/// need them.
bool MegaEngine::idle() const {
  if (playing_) return false;
  if (!log_read_) log_read_ = log_.taken_until(log_end_);
  return log_read_;
}

void MegaEngine::begin_wait(const Slot& wait) {
  waiting_ = true;
  wait_ = wait;
  wait_begin_ = next_;
  next_ += wait.ticks;
  const Recent& recent = recent_[wait.line & ~kStop];
  for (uint8_t level = 0; level < 2; ++level)
    if (recent.life[level] != 0 &&
        ends_wait(recent.tick[level], static_cast<uint8_t>(wait.line & ~kStop), level != 0))
      return end_wait(recent.tick[level], false);
}

bool MegaEngine::ends_wait(ShortTick tick, uint8_t input, bool level) const {
  if (!waiting_ || input != (wait_.line & ~kStop)) return false;
  if (before(tick, wait_begin_) || !before(tick, next_)) return false;
  return wait_.until == Until::both || (wait_.until == Until::rising) == level;
}

void MegaEngine::end_wait(ShortTick tick, bool timed_out) {
  waiting_ = false;
  Outcome& outcome = outcomes_[outcomes_put_ % kSlots];
  outcome = {tick, tick + kWaitLatency, timed_out};
  if (timed_out && (wait_.line & kStop) != 0) {
    stop_safe();
    outcome.resumed = clock_.now_locked();
  }
  next_ = outcome.resumed;
  outcomes_put_ = static_cast<uint8_t>(outcomes_put_ + 1);
}

void MegaEngine::awaited_edge(ShortTick tick, uint8_t input, bool level) {
  if (!ends_wait(tick, input, level)) return;
  end_wait(tick, false);
  if (playing_) set_alarm();
}

void MegaEngine::trip(uint8_t lines) {
  stop_safe();
  tripped_ = static_cast<uint8_t>(tripped_ | lines);
}

/// Keeps the outcomes of waits, which the firmware still has to read.
void MegaEngine::stop() {
  playing_ = false;
  log_read_ = true;
  waiting_ = false;
  taken_ = put_;
}

void MegaEngine::stop_safe() {
  put(safe_);
  stop();
}

void MegaEngine::stop_now() {
  stop_safe();
}

/// The first call makes the pins outputs. Before that they are inputs, as in reset: the stored safe levels
/// are not known yet, and a line that is safe at high would go low at each start.
void MegaEngine::put(uint8_t levels) {
  PORTA = levels;
  DDRA = kOutputMask;
  shown(levels, clock_.now_locked());
}

/// The outputs have these levels since `tick`.
void MegaEngine::shown(uint8_t levels, ShortTick tick) {
  const auto changed = static_cast<uint8_t>(levels_ ^ levels);
  levels_ = levels;
  if (changed != 0) log_.add_changes(tick, changed, levels);
}

}  // namespace symrig::mega2560
