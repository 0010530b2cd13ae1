// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/board_info.hpp"

#include <string_view>

#include <nlohmann/json.hpp>

namespace symrig::board {

/// What programs depend on of a board.
nlohmann::ordered_json board_json(const BoardInfo& board);
/// The text as JSON that nests no deeper than ours does. Throws nlohmann::json::exception and BadJson.
nlohmann::ordered_json parse_json(std::string_view text);

/// The inverse of board_json: a board that there can be. Throws nlohmann::json::exception and BadJson.
BoardInfo board_from_json(const nlohmann::ordered_json& json);

nlohmann::ordered_json line_json(const LineConfig& line);
/// Throws nlohmann::json::exception and BadJson.
LineConfig line_from_json(const nlohmann::ordered_json& json);

}  // namespace symrig::board
