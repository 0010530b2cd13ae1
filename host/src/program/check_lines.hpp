// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "program/findings.hpp"

namespace symrig::program {

/// Lines that the board has not, roles that no line has, lines used the wrong way round, lamps without a
/// keep-alive.
void check_lines(const ProgramFile& file, const BoardInfo& board, Findings& findings);

/// What of the device profiles in use is not from a source.
void check_profiles(const ProgramFile& file, Findings& findings);

}  // namespace symrig::program
