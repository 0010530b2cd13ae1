// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/types.hpp"

namespace symrig::hal {

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
