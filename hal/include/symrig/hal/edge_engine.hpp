// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/types.hpp"

namespace symrig::hal {

/// What ends a segment.
enum class Until : uint8_t {
  elapsed,  ///< its ticks have passed
  rising,   ///< the awaited line goes high (it must have been seen low before)
  falling,
  both
};

/// One word for all outputs and how long it stands. Bit k is line k.
///
/// A segment with an `until` is a wait: the word before it stands (levels is that word), and ticks is the
/// time-out. The first matching edge at or after its begin ends it; its end is told by pop_wait().
struct Segment {
  uint32_t levels = 0;
  uint32_t ticks = 0;
  Until until = Until::elapsed;
  uint8_t line = 0;              ///< awaited input
  bool stop_on_timeout = false;  ///< a wait that runs out ends the run: safe word, idle
};

/// How a wait ended.
struct WaitOutcome {
  Tick tick = 0;     ///< of the awaited edge, or when the time ran out
  Tick resumed = 0;  ///< when the next word went out (with stop_on_timeout: the safe word)
  bool timed_out = false;
};

/// Plays words on the outputs to the tick, from a queue that firmware keeps filled (on a Pico: a DMA ring and
/// a PIO state machine). The processor is never part of an edge.
///
///   idle --start--> playing --(queue ends, closed)---------> idle, the last word stands
///                   playing --(queue ends, open)-----------> idle, safe word, underrun() is true
///                   playing --(wait runs out, stop)--------> idle, safe word
///                   any     --(a trip line at its level)---> idle, safe word, tripped() tells the line
///
/// The three falls to the safe word are the engine's own: no firmware is in their way.
class EdgeEngine {
 public:
  /// Segments that can be pushed now.
  virtual size_t room() const = 0;
  /// Appends a segment. Only with room() > 0; segments pushed while idle wait for start().
  virtual void push(const Segment& segment) = 0;
  /// Nothing follows the segments pushed so far: the queue may run empty.
  virtual void close() = 0;
  /// Begins to play at `tick`, or at once if it has gone by. Returns the tick at which the first segment
  /// begins.
  virtual Tick start(Tick tick) = 0;

  virtual bool idle() const = 0;
  /// The word that stands on the outputs.
  virtual uint32_t levels() const = 0;
  /// The queue ran empty before close(), or (software that makes edges) a word came so late that its whole
  /// time had gone by: the engine fell to its safe word. Cleared by start() and force().
  virtual bool underrun() const = 0;
  /// Words put out since start(), waits not counted.
  virtual uint64_t played() const = 0;
  /// Words put out more than BoardTraits::lateness after their plan, since start(). None where hardware makes
  /// the edges.
  virtual uint32_t late() const { return 0; }
  /// Takes the oldest wait that has ended. false: none. At most kMaxWaits are kept; whoever pushes sees to
  /// it that no more are on their way.
  virtual bool pop_wait(WaitOutcome& outcome) = 0;

  /// Stops playing, empties the queue and puts `levels` out, now. The only way to drive outputs by hand.
  virtual void force(uint32_t levels) = 0;
  /// The word the engine falls to by itself.
  virtual void set_safe(uint32_t levels) = 0;
  /// Watches the input lines in `lines`: one that stands at its level in `levels` trips the engine. Forgets
  /// earlier trips.
  virtual void set_trips(uint32_t lines, uint32_t levels) = 0;
  /// Lines that have tripped the engine since set_trips(), bit k = line k.
  virtual uint32_t tripped() const = 0;

 protected:
  ~EdgeEngine() = default;
};

/// Waits pushed and not yet taken by pop_wait().
constexpr uint32_t kMaxWaits = 128;

}  // namespace symrig::hal
