// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/link.hpp"

#include <memory>
#include <string>

namespace symrig::board {

/// Claims the vendor interface of the board whose serial number begins with `serial`. fails: device_lost (no
/// such board, no permission, in use), bad_argument (several match), io (no USB).
Result<std::unique_ptr<Link>> open_usb(const std::string& serial);

}  // namespace symrig::board
