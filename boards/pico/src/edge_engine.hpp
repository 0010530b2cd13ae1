// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "registers.hpp"
#include "stampers.hpp"
#include "symrig/hal/edge_engine.hpp"
#include "tick_clock.hpp"

namespace symrig::pico {

/// Passes words from firmware to the edge engine's queue by DMA. DMA never reads a word that firmware has not
/// finished.
///
/// The data channel copies words from a ring to the state machine's queue, and stops after a given count.
/// Then the control channel gives it the next count from a list of counts ("grants"). A zero in the list
/// stops both channels. Firmware writes words first and their grant afterwards, so every granted word is
/// complete. If the channels reached the zero before a new grant was there, firmware starts them again. The
/// data channel's interrupt flag reports this: in quiet mode it flags only a zero.
class SegmentRing {
 public:
  static constexpr uint32_t kSegments = 1024;
  static constexpr uint32_t kWords = 2 * kSegments;
  /// One slot stays free to distinguish "all read" from "none read".
  static constexpr uint32_t kCapacity = kSegments - 1;

  /// Stops both channels and discards all words.
  void reset();
  /// Writes the two words of a segment. Only if used() < kCapacity.
  void write(uint32_t first, uint32_t second);
  /// Grants everything that is written.
  void grant();
  /// Starts the channels: from now on grants reach the queue.
  void open();
  /// Grants what is written if the channels have few grants left, and restarts stopped channels. Call it in
  /// every round of the main loop.
  void service();

  /// Times at which a channel had halted because of a bus error. No word follows then until reset(), so the
  /// queue runs empty.
  uint32_t errors() const { return errors_; }
  /// Segments that are written and not yet read.
  uint32_t used() const { return (static_cast<uint32_t>(written_) - place()) % kWords / 2; }
  /// Index of the next word to read.
  static uint32_t place();
  /// Words read since reset(). Must be called (grant() does it) before another full ring has been read.
  uint64_t read_words() const;

 private:
  static constexpr uint32_t kGrants = 64;
  static constexpr uint32_t kGrantEvery = 2 * 64;  // words; one DMA interrupt each

  uint32_t grants_unread() const;
  void restart() const;

  uint64_t written_ = 0;  // words since reset()
  uint64_t granted_ = 0;  // words since reset()
  uint64_t read_ = 0;
  uint32_t errors_ = 0;
  uint32_t grants_ = 0;  // number of grants since reset()
  bool open_ = false;
};

/// The part that watches the pins (pin_capture.hpp).
class PinWatch {
 public:
  virtual void watch_trips(uint32_t wanted, uint32_t trip_levels) = 0;
  /// All edges before this tick have been handled.
  virtual hal::Tick caught_up() const = 0;

 protected:
  ~PinWatch() = default;
};

/// hal::EdgeEngine with one PIO state machine that DMA feeds.
/// docs/board-pico-debug.md, "The edge engine".
class PicoEngine final : public hal::EdgeEngine {
 public:
  PicoEngine(const TickClock& clock, const Stampers& stampers) : clock_(clock), stampers_(stampers) {}

  /// Takes the output pins and sets all to low. pins must outlive the engine.
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

  /// The work outside of interrupts: keeps the ring running, ends waits. Call it in every round of the main
  /// loop.
  void service();
  /// Tick at which service() has work; kNever if none.
  hal::Tick next_deadline() const;
  bool playing() const { return playing_; }
  /// true: firmware must push more segments, because the queue is open and not full.
  bool hungry() const { return playing_ && !closed_ && room() > 0; }

  /// true: a run has just ended, and idle() is not true yet.
  bool ending() const { return !playing_ && ended_ && !idle(); }

  /// Words that were written to a full queue, and errors of DMA, since the board started. Both must stay 0.
  uint32_t overflows() const { return overflows_; }
  uint32_t dma_errors() const { return ring_.errors(); }

  /// Called by an interrupt: the input `lines` have gone to their trip levels, or are there.
  void trip(uint32_t lines);
  /// Called by an interrupt: safe levels at once, and nothing else until release(). The firmware should then
  /// call force(). Until then the engine reports that it is playing. After kPatience without force(), it
  /// reports an underrun.
  void fall();
  /// The firmware has handled what made the engine fall: outputs may move again.
  void release();
  /// Called by an interrupt: the alarm for the end of a wait.
  void time_is_up();
  /// Called by an interrupt: the PIO program has reached its end or its halt.
  void program_stopped();

 private:
  struct Wait {
    uint64_t segment = 0;  // its number, counted from the first push
    uint64_t offset = 0;   // ticks from the previous wait, or from the start, to its begin
    uint32_t timeout = 0;
    uint8_t line = 0;
    bool rising = false;
    bool stop = false;
  };
  static constexpr uint32_t kPatience = 1'250'000;  // 10 ms
  static constexpr uint32_t kWaits = hal::kMaxWaits;

  static void halt_machine();
  bool must_be_safe() const { return tripped_ != 0 || held_; }
  void connect_pins();
  void put_out(uint32_t levels);
  void load_safe();
  void forget_queue();
  void stop(bool to_safe);
  bool make_ready(hal::Tick tick);
  hal::Tick launch_when_near(hal::Tick tick);
  void launch();
  bool launch_in_time(uint32_t reference, uint32_t most);
  uint64_t pulled() const;
  static uint32_t intake();
  void settle();
  void set_alarm() const;
  bool settle_wait();
  hal::WaitOutcome edge_that_ended(const Wait& wait) const;
  bool run_out(const Wait& wait, hal::Tick when);
  bool end_wait(uint32_t intake_before, bool stop, uint32_t& stood);
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
  bool connected_ = false;  // the machine drives the pins
  bool fresh_ = true;       // the queue holds nothing of an earlier run
  volatile bool underrun_ = false;
  volatile bool fallen_ = false;
  volatile bool held_ = false;  // fallen, and the firmware has not read the reason yet
  hal::Tick fallen_at_ = 0;
  hal::Tick ended_at_ = 0;
  volatile bool ended_ = false;  // ended by itself, at the end of a closed queue
  uint32_t overflows_ = 0;
  uint32_t safe_ = 0;
  uint32_t last_levels_ = 0;

  hal::Tick launch_at_ = 0;
  uint32_t launch_count_ = 0;
  hal::Tick anchor_ = 0;  // tick of the first word, or of the first word after the last ended wait
  uint64_t offset_ = 0;   // ticks pushed since the last wait
  uint64_t pushed_ = 0;   // segments, waits included
  uint64_t played_at_stop_ = 0;

  // At most kWaits waits are pushed and not yet popped. [first_outcome_, first_wait_) have ended,
  // [first_wait_, next_wait_) have not.
  union Slot {
    Slot() : wait() {}
    Wait wait;
    hal::WaitOutcome outcome;
  };
  Slot waits_[kWaits];
  hal::Tick not_before_ = 0;  // earliest possible edge that ends the oldest wait
  volatile uint32_t first_wait_ = 0;
  volatile uint32_t next_wait_ = 0;
  volatile uint32_t first_outcome_ = 0;

  uint32_t trip_lines_ = 0;
  uint32_t trip_levels_ = 0;
  volatile uint32_t tripped_ = 0;
};

}  // namespace symrig::pico
