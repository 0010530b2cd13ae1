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

/// Sees the pins, outputs as well as inputs, whoever drives them.
class Capture {
 public:
  /// Levels of all lines now, bit k = line k.
  virtual uint32_t levels() const = 0;
  /// Takes the oldest edge. false: there is none. Edges come in order of time.
  virtual bool pop(CapturedEdge& edge) = 0;
  /// Edges were lost because they came faster than they were taken. Reading clears it.
  virtual bool take_overflow() = 0;
  /// Tells the lines whose edges are wanted (before: all). Those of other lines may be left out; on a board
  /// where an edge costs an interrupt they would only make the wanted ones late.
  virtual void watch(uint32_t /*lines*/) {}

 protected:
  ~Capture() = default;
};

}  // namespace symrig::hal
