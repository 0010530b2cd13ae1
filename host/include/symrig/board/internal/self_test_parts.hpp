// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/self_test.hpp"

namespace symrig::board {

/// fails: unknown_name (no such line), bad_argument (not an output, not an input, an input without stamps).
Result<void> check_jumper_lines(const BoardInfo& info, const Jumper& jumper);

/// Sends pulses through the jumper and adds the result to the test.
Result<void> check_jumper(Board& board, const Jumper& jumper, SelfTest& test);

/// Lets the board starve its watchdog, waits for its return, and looks at the reason that it gives. Then it
/// restarts the board once more, by request: the reason of a later start is not the test's. `board` has a new
/// session afterwards, and no configuration.
/// fails: as Board, if the board does not come back.
Result<WatchdogTest> test_watchdog(Board& board, const Reconnect& reconnect);

}  // namespace symrig::board
