// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/table_reader.hpp"
#include "symrig/program/profile.hpp"

namespace symrig::program {

// The keys of a profile, in its own file and, to override it, in a program's rig. A key that is given is no
// assumption any more.
void read_camera_keys(base::TableReader& table, CameraProfile& camera);
void read_projector_keys(base::TableReader& table, ProjectorProfile& projector);

}  // namespace symrig::program
