// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/board/board_info.hpp"

#include <string>
#include <string_view>

namespace symrig {

/// What programs depend on of a board, as JSON: to compile and lint for a board that is not at hand.
std::string board_file_text(const BoardInfo& board);

/// The inverse; what `symrig info --json` writes, a receipt (it holds its board) and the manifest of a
/// board's firmware will do too. fails: bad_format.
Result<BoardInfo> parse_board_file(std::string_view text);

}  // namespace symrig
