// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/board/board_info.hpp"
#include "symrig/protocol/line_config.hpp"
#include "symrig/protocol/program.hpp"

#include <span>
#include <string_view>

#include <nlohmann/json.hpp>

namespace symrig::board {

/// The configuration of all lines of a board in ticks. Lines that are not named get the defaults.
/// fails: unknown_name (no such line, or named twice), bad_argument (a limit out of range, limits on an
/// input).
Result<protocol::BoardConfig> line_setup(const BoardInfo& info, std::span<const LineConfig> lines);

/// The rules that the board checks programs against.
protocol::ProgramRules program_rules(const BoardInfo& info, const protocol::BoardConfig& config);

/// The properties of a board that programs depend on.
nlohmann::ordered_json board_json(const BoardInfo& board);
/// Parses JSON. Refuses JSON that is nested deeper than the files of symrig. Throws nlohmann::json::exception
/// and BadJson.
nlohmann::ordered_json parse_json(std::string_view text);

/// The inverse of board_json. Accepts only boards that can exist. Throws nlohmann::json::exception and
/// BadJson.
BoardInfo board_from_json(const nlohmann::ordered_json& json);

nlohmann::ordered_json line_json(const LineConfig& line);
/// Throws nlohmann::json::exception and BadJson.
LineConfig line_from_json(const nlohmann::ordered_json& json);

}  // namespace symrig::board
