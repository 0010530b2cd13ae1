// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "board_file.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace symrig::board_linux {

/// The board's unique id: the file's id, else 8 bytes that are computed from this computer's id and the
/// board's name. machine-id(5) forbids publishing the id itself.
/// fails: not_found (neither exists).
Result<std::vector<std::uint8_t>> unique_id(const BoardFile& file);
/// In hexadecimal, as the serial number of the USB device.
std::string hexadecimal(const std::vector<std::uint8_t>& bytes);

}  // namespace symrig::board_linux
