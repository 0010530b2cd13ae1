// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/fd.hpp"
#include "symrig/base/result.hpp"

#include <cstdint>
#include <string>

namespace symrig::board {

/// Opens a serial port raw (8N1, no echo, no flow control by characters), for this program only, with DTR and
/// RTS on. Discards bytes that arrived before. fails: device_lost (missing, no permission, in use),
/// bad_argument (not a serial port, an unknown baud rate).
Result<Fd> open_serial(const std::string& path, std::uint32_t baud);

}  // namespace symrig::board
