// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/rig/rig_file.hpp"

#include <memory>

namespace symrig {

/// How the devices that a rig file names are opened.
RigDevices devices_of(const RigFile& file);

/// Opens the devices that a file names, and opens them again when they were lost.
/// fails: as Rig::open() and the devices' own open().
Result<std::unique_ptr<Rig>> open_rig_file(RigFile file);

}  // namespace symrig
