// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/rig/rig_description.hpp"

#include <memory>

namespace symrig {

/// How the devices that a rig file names are opened.
RigDevices devices_of(const RigDescription& file);

/// Opens the devices that a file names, and opens them again when they were lost.
/// fails: as Rig::open() and the devices' own open().
Result<std::unique_ptr<Rig>> open_rig_file(RigDescription file);

}  // namespace symrig
