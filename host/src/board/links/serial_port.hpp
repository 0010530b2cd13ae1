// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/fd.hpp"
#include "symrig/base/result.hpp"

#include <cstdint>
#include <string>

namespace symrig::board {

/// Opens a serial port raw (8N1, no echo, no flow control by characters), for this program alone, with DTR
/// and RTS on. Bytes that were waiting in it are thrown away. fails: device_lost (not there, no permission,
/// in use), bad_argument (not a serial port, an unknown baud rate).
Result<base::Fd> open_serial(const std::string& path, std::uint32_t baud);

}  // namespace symrig::board
