// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "program/findings.hpp"
#include "program/moves.hpp"
#include "symrig/board/program.hpp"

#include <optional>
#include <vector>

namespace symrig::program {

struct Emitted {
  Program program;
  std::vector<int> places;  ///< line of the file for each record
};

/// Applies each line's delay, merges the lines' timelines into words, and writes the records. If a word
/// cannot be written, adds a finding and returns none.
///
/// Between waits and loop ends each line has its own timeline, shifted by its delay: an edge of time t goes
/// out at t + delay. Sorting merges the timelines, so delayed lines may overlap freely. But all edges of a
/// stretch must be out at its end, because the next step may begin at any time, or repeat.
std::optional<Emitted> emit(const MoveList& moves, const RigSetup& rig, const BoardInfo& board,
                            Findings& findings);

}  // namespace symrig::program
