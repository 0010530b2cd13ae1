// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/device_uri.hpp"
#include "symrig/board/link.hpp"

#include <memory>

namespace symrig::board {

/// A link that owns a new simulated board. The board has a projector and a camera, or instead of them the
/// uri's jumper. fails: unknown_name (a line of the jumper).
Result<std::unique_ptr<Link>> open_sim_device(const DeviceUri& uri);

}  // namespace symrig::board
