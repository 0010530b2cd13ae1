// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/board/board_info.hpp"

#include <string>
#include <string_view>

namespace symrig {

/// The properties of a board that programs depend on, as JSON: to compile and lint without the board.
std::string board_file_text(const BoardInfo& board);

/// The inverse of board_file_text(). Also accepts the output of `symrig info --json`, a receipt, and the
/// manifest of a board's firmware. fails: bad_format.
Result<BoardInfo> parse_board_file(std::string_view text);

}  // namespace symrig
