// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "segment_ring.hpp"
#include "stampers.hpp"
#include "symrig/hal/edge_engine.hpp"
#include "tick_clock.hpp"

namespace symrig::pico {

/// Who watches the pins (pin_capture.hpp).
class PinWatch {
 public:
  virtual void watch_trips(uint32_t wanted, uint32_t trip_levels) = 0;
  /// All edges before this tick have been taken.
  virtual hal::Tick caught_up() const = 0;

 protected:
  ~PinWatch() = default;
};

/// hal::EdgeEngine by one PIO state machine fed by DMA. README.md, "The edge engine".
class PicoEngine final : public hal::EdgeEngine {
 public:
  PicoEngine(const TickClock& clock, const Stampers& stampers) : clock_(clock), stampers_(stampers) {}

  /// Takes the output pins: all low. pins lives as long as the engine.
  void begin(PinWatch& pins);

  size_t room() const override;
  void push(const hal::Segment& segment) override;
  void close() override;
  hal::Tick start(hal::Tick tick) override;
  bool idle() const override;
  uint32_t levels() const override;
  bool underrun() const override;
  uint64_t played() const override;
  bool pop_wait(hal::WaitOutcome& outcome) override;
  void force(uint32_t levels) override;
  void set_safe(uint32_t levels) override;
  void set_trips(uint32_t lines, uint32_t levels) override;
  uint32_t tripped() const override { return tripped_; }

  /// What no interrupt does: keeps the ring going, ends waits. At every round of the main loop.
  void service();
  /// Tick at which service() has something to do; kNever if none.
  hal::Tick next_deadline() const;
  /// Firmware must keep pushing: the queue is open and not full.
  bool hungry() const { return playing_ && !closed_ && room() > 0; }

  /// A run has just ended, and somebody waits for idle().
  bool ending() const { return !playing_ && ended_ && !idle(); }

  /// Interrupt: the input `lines` have gone to a trip level, or stand there.
  void trip(uint32_t lines);
  /// Interrupt: safe levels at once. Whoever fell the engine will force() it soon; it says that it is playing
  /// until then, and that it ran dry if nobody does within kPatience.
  void fall();
  /// Interrupt: the alarm set for the end of a wait.
  void time_is_up();
  /// Interrupt: the program has come to its end or to a halt.
  void program_stopped();

 private:
  struct Wait {
    uint64_t segment = 0;  // its number since the first push
    uint64_t offset = 0;   // ticks from the wait before, or from the start, to its begin
    uint32_t timeout = 0;
    uint8_t line = 0;
    bool rising = false;
    bool stop = false;
  };
  static constexpr uint32_t kPatience = 1'250'000;  // 10 ms
  static constexpr uint32_t kWaits = hal::kMaxWaits;

  static void halt_machine();
  void put_out(uint32_t levels);
  void load_safe();
  void forget_queue();
  void stop(bool to_safe);
  void launch();
  uint64_t pulled() const;
  void settle();
  void set_alarm() const;
  bool settle_wait();
  hal::WaitOutcome edge_that_ended(const Wait& wait) const;
  bool run_out(const Wait& wait, hal::Tick when);
  void conclude_wait(const hal::WaitOutcome& outcome);
  hal::Tick wait_begin() const { return anchor_ + waits_[first_wait_ % kWaits].wait.offset; }
  uint32_t lines_at_trip() const;

  const TickClock& clock_;
  const Stampers& stampers_;
  PinWatch* pins_ = nullptr;
  SegmentRing ring_;
  volatile bool playing_ = false;
  bool closed_ = false;
  volatile bool launched_ = false;
  bool fresh_ = true;  // nothing of an earlier run is left in the queue
  volatile bool underrun_ = false;
  volatile bool fallen_ = false;
  hal::Tick fallen_at_ = 0;
  hal::Tick ended_at_ = 0;
  volatile bool ended_ = false;  // by itself, at the end of a closed queue
  uint32_t safe_ = 0;
  uint32_t last_levels_ = 0;

  hal::Tick launch_at_ = 0;
  hal::Tick anchor_ = 0;  // when the first word went out, or the first after the last wait that ended
  uint64_t offset_ = 0;   // ticks pushed since the last wait
  uint64_t pushed_ = 0;   // segments, waits included
  uint64_t played_at_stop_ = 0;

  // Waits pushed and not yet popped are at most kWaits: [first_outcome_, first_wait_) have ended,
  // [first_wait_, next_wait_) have not.
  union Slot {
    Slot() : wait() {}
    Wait wait;
    hal::WaitOutcome outcome;
  };
  Slot waits_[kWaits];
  hal::Tick not_before_ = 0;  // the edge that ends the oldest wait
  volatile uint32_t first_wait_ = 0;
  volatile uint32_t next_wait_ = 0;
  volatile uint32_t first_outcome_ = 0;

  uint32_t trip_lines_ = 0;
  uint32_t trip_levels_ = 0;
  volatile uint32_t tripped_ = 0;
};

}  // namespace symrig::pico
