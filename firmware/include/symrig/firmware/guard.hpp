// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/edge_engine.hpp"
#include "symrig/protocol/line_config.hpp"
#include "symrig/protocol/program.hpp"

namespace symrig::firmware {

/// A broken limit of a pin.
struct Breach {
  protocol::Rule rule = protocol::Rule::none;  ///< max_on, min_off or duty
  uint8_t line = 0;
  hal::Tick tick = 0;
};

/// Watches the pins themselves, independently of the program and the sequencer. It is the last of three
/// layers that keep a lamp within its limits. The core gives it captured edges in order of time, and calls
/// check() at next_deadline().
class Guard {
 public:
  /// Sets new limits, and the levels of the pins at `now`. Lines that were not watched before count as
  /// rested. For the others the last pulse is kept.
  void configure(const protocol::BoardConfig& config, uint32_t levels, hal::Tick now);

  /// Records an edge. true: it broke a limit.
  bool edge(const hal::CapturedEdge& edge, Breach& breach);
  /// true: at `now` a line has been on for longer than its max_on. A line that goes off exactly at its limit
  /// keeps it.
  bool check(hal::Tick now, Breach& breach) const;
  /// The first tick at which check() can find a new breach.
  hal::Tick next_deadline() const;
  /// The first line in `mask` that would break min_off or duty if it were turned on at `tick`; -1: none.
  /// needed: the missing rest in ticks.
  int cooling_line(uint32_t mask, hal::Tick tick, hal::Tick& needed) const;

  /// True if a line has a limit.
  bool watching() const { return watched_ != 0; }

 private:
  struct Watch {
    bool on = false;
    bool rested = true;  // off, and no pulse before is known
    hal::Tick since = 0;
    hal::Tick pulse = 0;  // duration of the last pulse
  };

  bool watches(unsigned line) const { return ((watched_ >> line) & 1U) != 0; }
  hal::Tick rest_needed(unsigned line) const;

  protocol::BoardConfig config_;
  Watch watches_[protocol::kMaxOutputs];
  uint32_t watched_ = 0;
};

}  // namespace symrig::firmware
