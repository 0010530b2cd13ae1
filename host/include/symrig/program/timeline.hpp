// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/board/board_info.hpp"
#include "symrig/board/program.hpp"

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
  std::size_t record = 0;  ///< the record that makes it

  bool operator==(const PlannedEdge&) const = default;
};

/// A wait of the program.
struct PlannedWait {
  std::size_t record = 0;
  int line = 0;
  EdgeKind edge = EdgeKind::rising;
  bool abort = false;  ///< the run ends if the wait times out
  Ticks begin;
  Ticks timeout;
  std::size_t marks = 0;  ///< number of marks before it
};

/// The result of a wait.
struct WaitOutcome {
  PlannedWait wait;
  bool timed_out = false;
  Ticks resumed;  ///< when the next record begins
};

/// Returns the tick of the awaited edge (at or after wait.begin), or none if no edge comes.
using AwaitedEdge = std::function<std::optional<Ticks>(const PlannedWait&)>;

struct TimelineOptions {
  Ticks start = {};                   ///< when the first record begins
  std::uint32_t initial_levels = 0;   ///< of all lines before that: the safe levels
  std::size_t max_edges = 1'000'000;  ///< stop after this many edges
  std::uint64_t max_rounds = ~0ULL;   ///< rounds of a loop at most; two show every pair of neighbouring steps
  AwaitedEdge edge_at = {};           ///< empty: every awaited edge comes at once
};

/// All edges that a program makes, as protocol/PROTOCOL.md defines them. The host computes them from the
/// records alone, without a board.
struct Timeline {
  TickRate rate;
  Ticks start;
  Ticks end;  ///< when the final levels are out, or where the timeline was cut off
  std::uint32_t initial_levels = 0;
  std::uint32_t final_levels = 0;
  std::vector<PlannedEdge> edges;  ///< sorted by time, then by line
  std::vector<StepMark> marks;
  std::vector<WaitOutcome> waits;
  std::uint64_t steps = 0;  ///< words that go out, without that of End
  bool complete = false;    ///< the program reached End
  bool cut_off = false;     ///< max_edges ended it; the edges up to `end` are correct
};

/// The cost is bounded by max_edges: at most 64 records for each allowed edge.
/// fails: bad_format (records without a meaning, loops that do not pair: see lint()).
Result<Timeline> expand(const Program& program, const BoardInfo& board, const TimelineOptions& options = {});

}  // namespace symrig
