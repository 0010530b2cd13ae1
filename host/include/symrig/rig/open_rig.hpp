// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/rig/rig_description.hpp"

#include <memory>

namespace symrig {

/// Functions that open the devices of a rig file.
RigDevices devices_of(const RigDescription& file);

/// Opens the devices of a rig file, and opens them again after a loss.
/// fails: as Rig::open() and the devices' own open().
Result<std::unique_ptr<Rig>> open_rig_file(RigDescription file);

}  // namespace symrig
