// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "board_file.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace symrig::board_linux {

/// The board's unique id: what the file says, else 8 bytes made from this machine's id and the board's name
/// (machine-id(5) asks not to give the id itself away). fails: not_found (neither is there).
Result<std::vector<std::uint8_t>> unique_id(const BoardFile& file);
/// In hexadecimal: the serial number of the USB device.
std::string hexadecimal(const std::vector<std::uint8_t>& bytes);

}  // namespace symrig::board_linux
