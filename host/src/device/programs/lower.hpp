// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "moves.hpp"

namespace symrig::device {

/// The moves of a program file that the checks have passed.
MoveList lower(const ProgramFile& file, const BoardInfo& board);

}  // namespace symrig::device
