// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "board_pins.hpp"
#include "edge_log.hpp"
#include "symrig/hal/edge_engine.hpp"
#include "tick_clock.hpp"

namespace symrig::mega2560 {

/// Plays words by interrupts of timer 1. The interrupt comes kLead ticks early and waits for the clock's
/// tick; then one store sets all outputs. So a word is late only if another interrupt ran longer than kLead.
///
/// Compare outputs that toggle by themselves would be exact to the cycle. But a timer toggles again after
/// each 65,536 ticks, also when the processor has stopped: that could switch a lamp on. A port keeps its
/// level.
class MegaEngine final : public hal::EdgeEngine {
 public:
  MegaEngine(const TickClock& clock, EdgeLog& log) : clock_(clock), log_(log) {}

  static void begin();

  // hal::EdgeEngine
  size_t room() const override;
  void push(const hal::Segment& segment) override;
  void close() override;
  hal::Tick start(hal::Tick tick) override;
  bool idle() const override;
  uint32_t levels() const override { return levels_; }
  bool underrun() const override { return underrun_; }
  uint64_t played() const override;
  uint32_t late() const override;
  bool pop_wait(hal::WaitOutcome& outcome) override;
  void force(uint32_t levels) override;
  void set_safe(uint32_t levels) override;
  void set_trips(uint32_t lines, uint32_t levels) override;
  uint32_t tripped() const override { return uint32_t{tripped_} << kOutputs; }

  // From interrupts, with interrupts off.
  void time_is_up();
  /// Each edge of a watched interlock trips, even if the line is back at its other level by now. edges: bit k
  /// is line kOutputs + k.
  __attribute__((always_inline)) void look_for_trips(uint8_t edges) {
    const auto hit = static_cast<uint8_t>(edges & trip_lines_ & ~tripped_);
    if (hit != 0) trip(hit);
  }
  /// An input changed at `tick`. input: line - kOutputs.
  __attribute__((always_inline)) void input(ShortTick tick, uint8_t input, bool level) {
    recent_[input].tick[level ? 1 : 0] = tick;
    recent_[input].life[level ? 1 : 0] = kLife;
    if (waiting_ && input == (wait_.line & ~kStop)) awaited_edge(tick, input, level);
  }
  /// At each overflow of the clock, 33 ms. One input at a time, because words wait meanwhile.
  __attribute__((always_inline)) void age_edges() {
    aged_ = aged_ + 1 == kLines - kOutputs ? 0 : static_cast<uint8_t>(aged_ + 1);
    for (uint8_t& life : recent_[aged_].life)
      if (life != 0) --life;
  }
  /// The host asks for an abort: the safe word at once.
  void stop_now();

 private:
  struct Slot {
    uint32_t ticks;
    uint8_t levels;
    hal::Until until;
    uint8_t line;  // of a wait: input number; bit 7: stop on time-out
  };
  struct Outcome {
    ShortTick tick;
    ShortTick resumed;
    bool timed_out;
  };
  static constexpr uint8_t kSlots = 16;  // a power of two; kQueueSegments of them are used
  static constexpr uint8_t kStop = 0x80;
  static_assert(kQueueSegments + 2 <= hal::kMaxWaits && kQueueSegments < kSlots && hal::kMaxWaits == kSlots);

  bool wait_for_tick(ShortTick tick) const;
  void act();
  void play(const Slot& slot);
  void begin_wait(const Slot& wait);
  bool ends_wait(ShortTick tick, uint8_t input, bool level) const;
  void end_wait(ShortTick tick, bool timed_out);
  void run_dry();
  void stop_safe();
  void stop();
  void trip(uint8_t lines);
  void awaited_edge(ShortTick tick, uint8_t input, bool level);
  void put(uint8_t levels);
  void shown(uint8_t levels, ShortTick tick);
  void set_alarm() const;
  bool starts_far_away() const;
  uint8_t used() const { return static_cast<uint8_t>(put_ - taken_); }

  const TickClock& clock_;
  EdgeLog& log_;
  Slot slots_[kSlots] = {};
  volatile uint8_t put_ = 0;
  volatile uint8_t taken_ = 0;
  Outcome outcomes_[kSlots] = {};
  volatile uint8_t outcomes_put_ = 0;
  volatile uint8_t outcomes_taken_ = 0;
  volatile bool playing_ = false;
  uint8_t log_end_ = 0;                    // where the log ended at the end of the run
  mutable volatile bool log_read_ = true;  // it has been read up to there
  volatile bool closed_ = false;
  volatile bool underrun_ = false;
  bool waiting_ = false;
  Slot wait_{};
  ShortTick wait_begin_ = 0;
  ShortTick next_ = 0;   // planned tick of the next word; in a wait: its time-out
  hal::Tick begin_ = 0;  // of the run
  bool far_ = false;     // the begin is more than kFarAway ahead
  uint32_t played_ = 0;
  uint16_t late_ = 0;
  volatile uint8_t levels_ = 0;
  uint8_t safe_ = 0;
  uint8_t trip_lines_ = 0;
  uint8_t trip_levels_ = 0;
  volatile uint8_t tripped_ = 0;
  // The last edges of each input, by level: a wait that begins late may have had its edge already. An edge is
  // forgotten after 0.2 to 0.4 s. Else its tick would be ahead again after 35 minutes.
  static constexpr uint8_t kLife = 2;
  struct Recent {
    ShortTick tick[2];
    uint8_t life[2];  // 0: there is none
  };
  Recent recent_[kLines - kOutputs] = {};
  uint8_t aged_ = 0;  // the input that was aged last
};

}  // namespace symrig::mega2560
