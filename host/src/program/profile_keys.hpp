// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/table_reader.hpp"
#include "symrig/program/profile.hpp"

namespace symrig::program {

// The keys of a profile: in its own file, or in a program's rig to override it. A key that is set there is no
// longer an assumption.
void read_camera_keys(base::TableReader& table, CameraProfile& camera);
void read_projector_keys(base::TableReader& table, ProjectorProfile& projector);

}  // namespace symrig::program
