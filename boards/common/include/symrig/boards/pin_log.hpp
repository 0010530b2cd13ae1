// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/boards/ring.hpp"
#include "symrig/hal/capture.hpp"

#include <cstddef>
#include <cstdint>

namespace symrig::board_common {

/// Edges of outputs and inputs until the firmware takes them, in order of time. Outputs are known at once,
/// inputs perhaps a little later: so edges are handed out only when none that is older can still come.
class PinLog {
 public:
  /// hold: ticks from an input's edge until it is known, at most. one_source: inputs' edges come in order of
  /// time, so that what is older than the last of them is settled.
  PinLog(std::size_t room, hal::Tick hold, bool one_source)
      : edges_(room), hold_(hold), one_source_(one_source) {}

  void watch(std::uint32_t lines) { watched_ = lines; }
  /// Sorts the edge in. A full log drops it, which counts as overflow.
  void add(const hal::CapturedEdge& edge);
  void add_input(const hal::CapturedEdge& edge);
  /// An edge for each line in `changed`, lowest first, to its level in `levels`.
  void add_changes(std::uint32_t changed, std::uint32_t levels, hal::Tick tick);
  /// Edges were lost elsewhere.
  void lose() { overflow_ = true; }
  /// Takes the oldest edge if it is old enough at `now`.
  bool pop(hal::CapturedEdge& edge, hal::Tick now);
  bool take_overflow();
  /// When pop() will have something; kNever if there is nothing.
  hal::Tick ready_at() const;

 private:
  Ring<hal::CapturedEdge> edges_;
  hal::Tick hold_;
  bool one_source_;
  hal::Tick settled_ = 0;  // no edge before it can still come
  std::uint32_t watched_ = UINT32_MAX;
  bool overflow_ = false;
};

}  // namespace symrig::board_common
