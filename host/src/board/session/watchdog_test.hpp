// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/fixture_test.hpp"

namespace symrig::board {

/// Lets the board starve its watchdog, waits for its return, and looks at the reason that it gives. Then it
/// restarts the board once more, by request: the reason of a later start is not the test's. `board` has a new
/// session afterwards, and no configuration.
/// fails: as Board, if the board does not come back.
Result<WatchdogTest> test_watchdog(Board& board, const Reconnect& reconnect);

}  // namespace symrig::board
