// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/device/profile.hpp"
#include "table_reader.hpp"

namespace symrig::device {

// The keys of a profile, in its own file and, to override it, in a program's rig. A key that is given is no
// assumption any more.
void read_camera_keys(TableReader& table, CameraProfile& camera);
void read_projector_keys(TableReader& table, ProjectorProfile& projector);

}  // namespace symrig::device
