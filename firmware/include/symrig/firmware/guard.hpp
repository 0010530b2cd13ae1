// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/capture.hpp"
#include "symrig/protocol/line_config.hpp"
#include "symrig/protocol/program_rules.hpp"

namespace symrig::firmware {

/// A limit broken on a pin.
struct Breach {
  protocol::Rule rule = protocol::Rule::none;  ///< max_on, min_off or duty
  uint8_t line = 0;
  hal::Tick tick = 0;
};

/// Watches the pins themselves, whatever the program or the sequencer believe: the last of three layers that
/// keep a lamp within its limits. Fed with captured edges in order of time and asked again at
/// next_deadline().
class Guard {
 public:
  /// Takes new limits, and the levels of the pins at `now`. Lines not watched before count
  /// as rested; of the others the last pulse is remembered.
  void configure(const protocol::BoardConfig& config, uint32_t levels, hal::Tick now);

  /// An edge was seen. true: it broke a limit.
  bool edge(const hal::CapturedEdge& edge, Breach& breach);
  /// true: at `now` a line has been on for longer than its max_on. One tick is the grain: a line that goes
  /// off exactly at its limit is within it.
  bool check(hal::Tick now, Breach& breach) const;
  /// First tick at which check() can find something new.
  hal::Tick next_deadline() const;
  /// First line in `mask` that would break min_off or duty if it were turned on at `tick`; -1: none. needed:
  /// the rest it still lacks then, in ticks.
  int cooling_line(uint32_t mask, hal::Tick tick, hal::Tick& needed) const;

  /// Some line has a limit.
  bool watching() const { return watched_ != 0; }

 private:
  struct Watch {
    bool on = false;
    bool rested = true;  // off for as long as anyone remembers
    hal::Tick since = 0;
    hal::Tick pulse = 0;  // the last pulse
  };

  bool watches(unsigned line) const { return ((watched_ >> line) & 1U) != 0; }
  hal::Tick rest_needed(unsigned line) const;

  protocol::BoardConfig config_;
  Watch watches_[protocol::kMaxOutputs];
  uint32_t watched_ = 0;
};

}  // namespace symrig::firmware
