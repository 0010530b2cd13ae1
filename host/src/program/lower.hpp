// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "program/moves.hpp"

namespace symrig::program {

/// The moves of a program file that the checks have passed.
MoveList lower(const ProgramFile& file, const BoardInfo& board);

}  // namespace symrig::program
