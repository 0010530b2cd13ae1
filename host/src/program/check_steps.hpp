// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "program/findings.hpp"
#include "symrig/program/timeline.hpp"

namespace symrig::program {

/// Checks the durations and time-outs of a program with steps, and a scan's time-out, against the board.
void check_times(const ProgramFile& file, const BoardInfo& board, Findings& findings);

/// Checks the pulses on the camera's line of a program with steps against the camera. timeline: with at most
/// two rounds of every loop, which shows every pair of neighbouring pulses.
void check_camera_pulses(const ProgramFile& file, const BoardInfo& board, const Timeline& timeline,
                         const std::vector<int>& places, Findings& findings);

}  // namespace symrig::program
