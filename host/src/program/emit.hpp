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

/// Puts each line's delay in, merges the lines' timelines into words, and writes the records. What cannot be
/// written becomes a finding; then the result is none.
///
/// Between waits and loop ends each line has a timeline of its own, shifted by its delay: an edge that was
/// set at t is out at t + delay. The timelines are merged by sorting, so lines with delays may overlap
/// freely; but all edges of a stretch must be out when it ends, because what follows may begin at any time or
/// again.
std::optional<Emitted> emit(const MoveList& moves, const RigSetup& rig, const BoardInfo& board,
                            Findings& findings);

}  // namespace symrig::program
