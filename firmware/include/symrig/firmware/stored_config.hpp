// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/board.hpp"
#include "symrig/protocol/line_config.hpp"

namespace symrig::firmware {

/// What a board keeps over power-off.
struct StoredConfig {
  protocol::BoardConfig config;
  char label[24] = {};  ///< as its user calls the board
};

// The record: "SRC1", 24 bytes of label, u8 lines, 3 bytes 0, then protocol's 24-byte record for each
// configured line, then CRC-32C over all before it.

/// false: the board's memory did not take it.
bool save(hal::Settings& settings, const StoredConfig& stored);
/// false: nothing is kept, it is damaged, or it is not for this board's lines.
bool load(const hal::Settings& settings, const hal::BoardTraits& board, StoredConfig& stored);

}  // namespace symrig::firmware
