// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <cstdint>

namespace symrig {

/// The termios code of a baud rate.  fails: bad_argument (there is no such rate; the hint is the next one
/// above).
Result<std::uint32_t> serial_speed(std::uint32_t baud);

/// Makes a serial line raw: every byte passes unchanged, 8 bits, no flow control. speed: of serial_speed().
/// errno says why where it is false: the descriptor is no serial port, or the port refuses the speed.
bool make_raw_line(int descriptor, std::uint32_t speed);

}  // namespace symrig
