// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/table_reader.hpp"
#include "symrig/rig/rig_description.hpp"

namespace symrig {

/// Read `[camera]`, `[projector]` and `[capture]` of a rig file. They add errors to the reader's context.
void read_camera_entry(base::TableReader& top, RigUse use, RigDescription& rig);
void read_projector_entry(base::TableReader& top, RigDescription& rig);
void read_capture_entry(base::TableReader& top, RigDescription& rig);

}  // namespace symrig
