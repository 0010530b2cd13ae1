// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/types.hpp"

namespace symrig::hal {

/// One word for all outputs and how long it stands. Bit k is line k.
struct Segment {
  uint32_t levels = 0;
  uint32_t ticks = 0;
};

/// Plays words on the outputs to the tick, from a queue that firmware keeps filled (on a Pico: a DMA ring and
/// a PIO state machine). The processor is never part of an edge.
///
///   idle --start--> playing --(queue ends, closed)--> idle, the last word stands
///                   playing --(queue ends, open)----> idle, underrun() is true
class EdgeEngine {
 public:
  /// Segments that can be pushed now.
  virtual size_t room() const = 0;
  /// Appends a segment. Only with room() > 0; segments pushed while idle wait for start().
  virtual void push(const Segment& segment) = 0;
  /// Nothing follows the segments pushed so far: the queue may run empty.
  virtual void close() = 0;
  /// Begins to play at `tick`, or at once if it has gone by. Returns the tick at which the first word goes
  /// out.
  virtual Tick start(Tick tick) = 0;

  virtual bool idle() const = 0;
  /// The word that stands on the outputs.
  virtual uint32_t levels() const = 0;
  /// The queue ran empty before close(): the last word stood too long. Cleared by start() and force().
  virtual bool underrun() const = 0;
  /// Words put out since start().
  virtual uint32_t played() const = 0;

  /// Stops playing, empties the queue and puts `levels` out, now. The only way to drive outputs by hand.
  virtual void force(uint32_t levels) = 0;

 protected:
  ~EdgeEngine() = default;
};

}  // namespace symrig::hal
