// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/device_uri.hpp"
#include "symrig/board/link.hpp"

#include <memory>

namespace symrig::board {

/// A link to a new simulated board that it owns: with a projector and a camera, or with the uri's jumper in
/// their place. fails: unknown_name (a line of the jumper).
Result<std::unique_ptr<Link>> open_sim_device(const DeviceUri& uri);

}  // namespace symrig::board
