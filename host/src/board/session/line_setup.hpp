// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/board/board_info.hpp"
#include "symrig/protocol/line_config.hpp"
#include "symrig/protocol/program.hpp"

#include <span>

namespace symrig::board {

/// The configuration of all lines of a board in ticks. Lines that are not named get the defaults.
/// fails: unknown_name (no such line, or named twice), bad_argument (a limit out of range, limits on an
/// input).
Result<protocol::BoardConfig> line_setup(const BoardInfo& info, std::span<const LineConfig> lines);

/// The rules that the board checks programs against.
protocol::ProgramRules program_rules(const BoardInfo& info, const protocol::BoardConfig& config);

}  // namespace symrig::board
