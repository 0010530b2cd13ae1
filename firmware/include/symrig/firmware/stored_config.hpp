// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/board.hpp"
#include "symrig/protocol/line_config.hpp"

namespace symrig::firmware {

/// The user's name for the board; ends with a 0.
struct Label {
  char text[24] = {};
};

// The record: "SRC1", 24 bytes of label, u8 lines, 3 bytes 0, then protocol's 24-byte record for each
// configured line, then CRC-32C over all before it.

/// Stores both in the permanent memory. false: the memory failed.
bool save_config(hal::Settings& settings, const protocol::BoardConfig& config, const Label& label);
/// Reads both; config must be empty before. false: nothing is stored, the record is damaged, or it is not for
/// this board's lines. Then config may have changed.
bool load_config(const hal::Settings& settings, const hal::BoardTraits& board, protocol::BoardConfig& config,
                 Label& label);

}  // namespace symrig::firmware
