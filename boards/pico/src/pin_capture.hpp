// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "edge_engine.hpp"
#include "stampers.hpp"
#include "symrig/hal/edge_engine.hpp"

namespace symrig::pico {

/// hal::Capture with PIO stamps for the stamped inputs. Every other watched line has an interrupt for each
/// edge. Outputs, too, so that a guard sees the pins and not only what PIO and DMA should do.
///
/// Trips use the same interrupt at the highest priority. It stops the engine before anything else.
class PinCapture final : public hal::Capture, public PinWatch {
 public:
  PinCapture(const TickClock& clock, Stampers& stampers, PicoEngine& engine)
      : clock_(clock), stampers_(stampers), engine_(engine) {}

  /// Inputs get a pull-down. Enables the interrupts.
  void begin();

  uint32_t levels() const override { return line_levels(); }
  bool pop(hal::CapturedEdge& edge) override;
  bool take_overflow() override;

  void watch(uint32_t wanted) override;
  void watch_trips(uint32_t wanted, uint32_t trip_levels) override;
  hal::Tick caught_up() const override { return caught_up_; }
  /// Number of edges that one round of the main loop may take. The rest waits for the next round.
  void begin_round() { round_left_ = kPerRound; }
  /// true: edges wait to be taken.
  bool pending() const;
  /// Call once a millisecond. Enables the interrupts of lines again that were too fast.
  void service();

  /// The interrupt handler.
  void handle();

 private:
  static constexpr uint32_t kRing = 256;
  static constexpr uint32_t kSources = Stampers::kCount + 1;
  static constexpr uint32_t kGroups = 3;
  static constexpr uint32_t kInputGroup = 2;  // GPIO 16..23
  static constexpr uint32_t kMostPerMillisecond = 64;
  static constexpr uint32_t kPerRound = 8;
  static constexpr uint32_t kOutOfTurn = 250;  // ticks: a later stamp may not have arrived yet

  bool peek(uint32_t source, hal::CapturedEdge& edge);
  /// A trip must not wait for the end of this interrupt: call it between all steps.
  void look_for_trips() {
    const uint32_t hit = reg(io::ints(kInputGroup)) & trip_flags_;
    if (hit != 0) judge_trips(hit);
  }
  void judge_trips(uint32_t hit);
  void record(uint32_t group, uint32_t flags);
  void add(uint32_t line, bool level, hal::Tick tick);
  void enable_interrupts(bool watched);

  const TickClock& clock_;
  Stampers& stampers_;
  PicoEngine& engine_;
  hal::CapturedEdge edges_[kRing];
  volatile uint32_t first_ = 0;
  volatile uint32_t next_ = 0;
  volatile bool overflow_ = false;
  volatile uint32_t in_this_millisecond_ = 0;
  uint64_t millisecond_end_ = 0;  // us
  uint32_t round_left_ = 0;
  hal::Tick caught_up_ = 0;
  uint32_t watch_flags_[kGroups] = {};
  uint32_t trip_flags_ = 0;  // in the inputs' group; not those of lines that have tripped
};

}  // namespace symrig::pico
