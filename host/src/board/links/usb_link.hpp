// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/link.hpp"

#include <memory>
#include <string>

namespace symrig::board {

/// Claims the vendor interface of the board whose serial number begins so. fails: device_lost (not there, no
/// permission, in use), bad_argument (several fit), io (no USB).
Result<std::unique_ptr<Link>> open_usb(const std::string& serial);

}  // namespace symrig::board
