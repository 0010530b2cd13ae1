// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/self_test.hpp"

namespace symrig::board {

/// fails: unknown_name (no such line), bad_argument (not an output, not an input, an input without stamps).
Result<void> check_jumper_lines(const BoardInfo& info, const Jumper& jumper);

/// Sends pulses through the jumper and adds the result to the test.
Result<void> check_jumper(Board& board, const Jumper& jumper, SelfTest& test);

}  // namespace symrig::board
