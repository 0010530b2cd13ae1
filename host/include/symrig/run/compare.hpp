// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/board/board_info.hpp"
#include "symrig/board/program.hpp"
#include "symrig/program/timeline.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace symrig {

/// The planned timeline of a run: the program's timeline from the tick of its start. Each wait ends at the
/// edge that the board captured. If the board did not capture that line, the next mark gives the end of the
/// wait. fails: as expand().
Result<Timeline> plan_of_run(const Program& program, const BoardInfo& board,
                             std::span<const LineConfig> lines, const Receipt& receipt,
                             std::size_t max_edges = 1'000'000);

/// A planned edge and the tick of its captured edge.
struct EdgePair {
  PlannedEdge planned;
  Ticks actual;

  /// Actual minus planned, ticks.
  std::int64_t late() const { return static_cast<std::int64_t>(actual.count - planned.tick.count); }
};

struct Comparison {
  std::vector<EdgePair> pairs;          ///< in the order of the plan
  std::vector<PlannedEdge> missing;     ///< planned on a captured line, but not captured
  std::vector<CapturedEdge> unplanned;  ///< captured on an output, but not planned
  std::int64_t largest = 0;             ///< of |late()|, ticks
  double mean = 0;                      ///< of late(), ticks

  bool exact() const { return missing.empty() && unplanned.empty() && largest == 0; }
};

/// Pairs planned and captured edges line by line, in order. watched: bit k = edges of line k are captured;
/// edges of other lines are ignored. An edge without a partner of its level is missing or unplanned. It does
/// not shift the pairs after it.
Comparison compare(const Timeline& plan, std::span<const CapturedEdge> captured, std::uint32_t watched);

/// The outputs of a board whose edges the configuration captures, bit k = line k.
std::uint32_t watched_outputs(const BoardInfo& board, std::span<const LineConfig> lines);
/// Levels of the outputs before a run.
std::uint32_t safe_levels(const BoardInfo& board, std::span<const LineConfig> lines);

}  // namespace symrig
