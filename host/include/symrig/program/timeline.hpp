// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/board/board_info.hpp"
#include "symrig/board/program.hpp"
#include "symrig/board/receipt.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace symrig {

/// An edge that a program makes.
struct PlannedEdge {
  int line = 0;
  bool level = false;
  Ticks tick;
  std::size_t record = 0;  ///< of the program, that makes it

  bool operator==(const PlannedEdge&) const = default;
};

/// A wait as the program comes to it.
struct PlannedWait {
  std::size_t record = 0;
  int line = 0;
  EdgeKind edge = EdgeKind::rising;
  bool abort = false;  ///< the run ends if it runs out
  Ticks begin;
  Ticks timeout;
  std::size_t marks = 0;  ///< marks passed before it
};

/// What became of a wait.
struct WaitOutcome {
  PlannedWait wait;
  bool timed_out = false;
  Ticks resumed;  ///< when the next record begins
};

/// Tells when the awaited edge comes (at or after wait.begin); none: it does not.
using AwaitedEdge = std::function<std::optional<Ticks>(const PlannedWait&)>;

struct TimelineOptions {
  Ticks start = {};                   ///< when the first record begins
  std::uint32_t initial_levels = 0;   ///< of all lines before that: the safe levels
  std::size_t max_edges = 1'000'000;  ///< stop after so many
  std::uint64_t max_rounds = ~0ULL;   ///< go through a loop at most that often; two show every neighbourhood
  AwaitedEdge edge_at = {};           ///< empty: every awaited edge comes at once
};

/// All edges that a program makes, as protocol/PROTOCOL.md defines it; worked out on the host from the
/// records alone, without any board.
struct Timeline {
  TickRate rate;
  Ticks start;
  Ticks end;  ///< when the final levels are out, or where it was cut off
  std::uint32_t initial_levels = 0;
  std::uint32_t final_levels = 0;
  std::vector<PlannedEdge> edges;  ///< in order of time, then of line
  std::vector<StepMark> marks;
  std::vector<WaitOutcome> waits;
  std::uint64_t steps = 0;  ///< words put out, End's not counted
  bool complete = false;    ///< it came to End
  bool cut_off = false;     ///< by max_edges; what is there is right
};

/// Work is bounded by max_edges: at most 64 records are looked at for each edge that may be kept.
/// fails: bad_format (records that mean nothing, loops that do not pair: see lint()).
Result<Timeline> expand(const Program& program, const BoardInfo& board, const TimelineOptions& options = {});

}  // namespace symrig
