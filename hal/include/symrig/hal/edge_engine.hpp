// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/clock.hpp"

namespace symrig::hal {

/// What ends a segment.
enum class Until : uint8_t {
  elapsed,  ///< its ticks have passed
  rising,   ///< the awaited line goes high (the engine must have seen it low before)
  falling,
  both
};

/// One word for all outputs and its duration. Bit k is line k.
///
/// A segment with an `until` is a wait: the last word stays (levels is that word), and ticks is the time-out.
/// The first matching edge at or after its begin ends it. pop_wait() reports its end.
struct Segment {
  uint32_t levels = 0;
  uint32_t ticks = 0;
  Until until = Until::elapsed;
  uint8_t line = 0;              ///< awaited input
  bool stop_on_timeout = false;  ///< a wait that times out ends the run: safe word, idle
};

/// How a wait ended.
struct WaitOutcome {
  Tick tick = 0;     ///< tick of the awaited edge, or of the time-out
  Tick resumed = 0;  ///< when the next word went out (with stop_on_timeout: the safe word)
  bool timed_out = false;
};

/// Plays words on the outputs, exact to the tick, from a queue that the firmware refills (on a Pico: a DMA
/// ring and a PIO state machine). The processor never makes an edge.
///
///   idle --start--> playing --(queue ends, closed)---------> idle, the last word stays
///                   playing --(queue ends, open)-----------> idle, safe word, underrun() is true
///                   playing --(wait times out, stop)-------> idle, safe word
///                   any     --(a trip line at its level)---> idle, safe word, tripped() names the line
///
/// The engine makes these three transitions to the safe word by itself, without firmware.
class EdgeEngine {
 public:
  /// The number of segments that can be pushed now.
  virtual size_t room() const = 0;
  /// Appends a segment. Only with room() > 0; segments pushed while idle wait for start().
  virtual void push(const Segment& segment) = 0;
  /// No more segments will follow: the queue may run empty.
  virtual void close() = 0;
  /// Begins to play at `tick`, or at once if it has passed. Returns the tick at which the first segment
  /// begins.
  virtual Tick start(Tick tick) = 0;

  virtual bool idle() const = 0;
  /// The present word of the outputs.
  virtual uint32_t levels() const = 0;
  /// True if the queue ran empty before close(). With edges made by software: also if a word was so late that
  /// its whole time had passed. The engine then went to its safe word. start() and force() clear it.
  virtual bool underrun() const = 0;
  /// The number of words that went out since start(), without waits.
  virtual uint64_t played() const = 0;
  /// The number of words since start() that went out more than BoardTraits::lateness after their plan. 0 if
  /// hardware makes the edges.
  virtual uint32_t late() const { return 0; }
  /// Removes the oldest wait that has ended. false: none. At most kMaxWaits are kept. The caller of push()
  /// must not have more in flight.
  virtual bool pop_wait(WaitOutcome& outcome) = 0;

  /// Stops playing, empties the queue and sets the outputs to `levels` at once. The only way to set outputs
  /// by hand. While tripped() is not 0, the outputs go to the safe word instead, whatever `levels` says. This
  /// holds for a trip at any moment of this call.
  virtual void force(uint32_t levels) = 0;
  /// Sets the word to which the engine goes by itself.
  virtual void set_safe(uint32_t levels) = 0;
  /// Watches the input lines in `lines`. A line at its level in `levels` trips the engine. Clears earlier
  /// trips, except those of lines that stay watched: an interrupt may have set them just now.
  virtual void set_trips(uint32_t lines, uint32_t levels) = 0;
  /// Lines that have tripped the engine since set_trips(), bit k = line k.
  virtual uint32_t tripped() const = 0;

 protected:
  ~EdgeEngine() = default;
};

/// The largest number of pushed waits that pop_wait() has not removed yet. A board with little memory keeps
/// fewer: its build defines SYMRIG_MAX_WAITS, at least queue_segments + 2. Then its queue is full before this
/// bound is reached, and the proof of the refill (protocol/program_timing.hpp) holds unchanged.
#ifdef SYMRIG_MAX_WAITS
constexpr uint32_t kMaxWaits = SYMRIG_MAX_WAITS;
#else
constexpr uint32_t kMaxWaits = 128;
#endif
static_assert((kMaxWaits & (kMaxWaits - 1)) == 0, "stretches are numbered modulo 2^32");

/// A change of a pin's level, stamped by hardware.
struct CapturedEdge {
  Tick tick = 0;
  uint8_t line = 0;
  bool level = false;
};

/// Reads the pins, outputs and inputs, independently of who drives them.
class Capture {
 public:
  /// The present levels of all lines, bit k = line k.
  virtual uint32_t levels() const = 0;
  /// Removes the oldest edge. false: there is none. Edges are in order of time.
  virtual bool pop(CapturedEdge& edge) = 0;
  /// True if edges were lost because they came faster than they were read. Clears this.
  virtual bool take_overflow() = 0;
  /// Inputs whose edges the board has stopped to take since the last call, because they came so fast that
  /// nothing else could run; bit k = line k. The board takes them again by itself.
  virtual uint32_t take_chatter() { return 0; }
  /// Sets the lines whose edges are needed (before: all). Edges of other lines may be omitted. On a board
  /// where each edge costs an interrupt, they would delay the needed ones.
  virtual void watch(uint32_t /*lines*/) {}

 protected:
  ~Capture() = default;
};

}  // namespace symrig::hal
