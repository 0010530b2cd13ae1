// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "program/findings.hpp"
#include "symrig/program/timeline.hpp"

namespace symrig::program {

/// Durations and time-outs of a program written by hand, and a scan's time-out, against the board.
void check_times(const ProgramFile& file, const BoardInfo& board, Findings& findings);

/// The pulses that a program written by hand makes on the camera's line, against the camera. timeline: with
/// every loop gone through at most twice, which shows each neighbourhood of pulses.
void check_camera_pulses(const ProgramFile& file, const BoardInfo& board, const Timeline& timeline,
                         const std::vector<int>& places, Findings& findings);

}  // namespace symrig::program
