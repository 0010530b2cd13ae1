// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/boards/ring.hpp"
#include "symrig/hal/capture.hpp"

#include <cstddef>
#include <cstdint>

namespace symrig::board_common {

/// Keeps edges of outputs and inputs in order of time until the firmware takes them. Output edges are known
/// at once, input edges possibly later. So an edge is given out only when no older one can still arrive.
class PinLog {
 public:
  /// hold: longest time in ticks from an input's edge until it is known. one_source: input edges arrive in
  /// order of time, so no edge older than the last one can still arrive.
  PinLog(std::size_t room, hal::Tick hold, bool one_source)
      : edges_(room), hold_(hold), one_source_(one_source) {}

  void watch(std::uint32_t lines) { watched_ = lines; }
  /// Inserts the edge by its time. A full log drops it and counts an overflow.
  void add(const hal::CapturedEdge& edge);
  void add_input(const hal::CapturedEdge& edge);
  /// Adds an edge to its level in `levels` for each line in `changed`, lowest line first.
  void add_changes(std::uint32_t changed, std::uint32_t levels, hal::Tick tick);
  /// Edges were lost elsewhere.
  void lose() { overflow_ = true; }
  /// Takes the oldest edge if it is old enough at `now`.
  bool pop(hal::CapturedEdge& edge, hal::Tick now);
  bool take_overflow();
  /// The time from which pop() returns an edge; kNever if the log is empty.
  hal::Tick ready_at() const;

 private:
  Ring<hal::CapturedEdge> edges_;
  hal::Tick hold_;
  bool one_source_;
  hal::Tick settled_ = 0;  // no older edge can still arrive
  std::uint32_t watched_ = UINT32_MAX;
  bool overflow_ = false;
};

}  // namespace symrig::board_common
