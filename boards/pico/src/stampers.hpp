// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/edge_engine.hpp"
#include "tick_clock.hpp"

#include <stdint.h>  // NOLINT(modernize-deprecated-headers)

namespace symrig::pico {

/// Present levels of all lines, bit k = line k.
uint32_t line_levels();

/// Time-stamps every edge of up to four input pins, with one PIO1 state machine per pin and DMA into a ring
/// in RAM. Resolution 2 ticks. An edge less than 8 ticks after another may be missed. See
/// docs/board-pico-debug.md, "Time stamps".
class Stampers {
 public:
  static constexpr uint32_t kCount = 3;
  static constexpr uint32_t kRing = 512;  ///< edges stored per pin

  /// Starts all machines in the same cycle. The clock must be running.
  void start(const TickClock& clock);

  /// Selects whether peek() returns the edges of input `index` from now on. find() returns them in any case.
  void show(uint32_t index, bool shown);
  /// The oldest edge of input `index` that was not taken. false: none.
  bool peek(uint32_t index, hal::Tick& tick, bool& level) const;
  void drop(uint32_t index) { ++taken_[index]; }
  bool pending() const;
  /// Call from time to time: a DMA channel stops after 2^32 - 1 edges, and this restarts it.
  void service();
  /// true: edges were lost since the last call.
  bool take_overflow();

  /// The first edge to `level` of input `index` at or after `from`, among those in the ring. false: none.
  bool find(uint32_t index, bool level, hal::Tick from, hal::Tick& tick) const;

 private:
  static uint32_t written(uint32_t index);
  hal::Tick tick_of(uint32_t stamp, hal::Tick now) const;

  const TickClock* clock_ = nullptr;
  hal::Tick epoch_ = 0;  // tick of count 0
  bool shown_[kCount] = {};
  mutable uint32_t taken_[kCount] = {};
  mutable bool overflow_ = false;
};

}  // namespace symrig::pico
