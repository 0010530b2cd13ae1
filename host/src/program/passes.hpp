// SPDX-License-Identifier: Apache-2.0
// The passes of compile(): checks, moves, words and records, durations.
#pragma once

#include "program/findings.hpp"
#include "program/moves.hpp"
#include "symrig/board/program.hpp"
#include "symrig/program/compile.hpp"
#include "symrig/program/timeline.hpp"

#include <optional>
#include <vector>

namespace symrig::program {

/// Reports unknown lines, missing roles, wrong directions, and lamps without a keep-alive.
void check_lines(const ProgramFile& file, const BoardInfo& board, Findings& findings);

/// Reports numbers of the device profiles that have no source.
void check_profiles(const ProgramFile& file, Findings& findings);

/// Checks the durations and time-outs of a program with steps, and a scan's time-out, against the board.
void check_times(const ProgramFile& file, const BoardInfo& board, Findings& findings);

/// Checks the pulses on the camera's line of a program with steps against the camera. timeline: with at most
/// two rounds of every loop, which shows every pair of neighbouring pulses.
void check_camera_pulses(const ProgramFile& file, const BoardInfo& board, const Timeline& timeline,
                         const std::vector<int>& places, Findings& findings);

/// Checks a scan against the limits of its camera, its projector and its lamp.
void check_scan(const RigSetup& rig, const Scan& scan, const BoardInfo& board, Findings& findings);

/// Checks a scan against the bit planes of its projector.
void check_planes(const RigSetup& rig, const Scan& scan, Findings& findings);

/// The moves of a program file that the checks have passed.
MoveList lower(const ProgramFile& file, const BoardInfo& board);

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

/// Computes steps, shortest and longest time from the records alone. Sets `expected` to the shortest.
void fill_durations(CompiledProgram& compiled);

}  // namespace symrig::program
