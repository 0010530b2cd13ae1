// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/device/board_info.hpp"

#include <nlohmann/json.hpp>

namespace symrig::device {

/// What programs depend on of a board.
nlohmann::ordered_json board_json(const BoardInfo& board);
/// The inverse. Throws nlohmann::json::exception.
BoardInfo board_from_json(const nlohmann::ordered_json& json);

nlohmann::ordered_json line_json(const LineConfig& line);
LineConfig line_from_json(const nlohmann::ordered_json& json);

}  // namespace symrig::device
