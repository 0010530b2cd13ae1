// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/internal/table_reader.hpp"
#include "symrig/camera/internal/driver.hpp"
#include "symrig/rig/rig_file.hpp"

#include <filesystem>
#include <string>

namespace symrig {

/// Read `[camera]`, `[projector]` and `[capture]` of a rig file. They add errors to the reader's context.
void read_camera_entry(base::TableReader& top, RigUse use, RigDescription& rig);
void read_projector_entry(base::TableReader& top, RigDescription& rig);
void read_capture_entry(base::TableReader& top, RigDescription& rig);
/// Reads all `[[pair]]`. Each has `uri` and `secret`, or `[pair.camera]` and `[pair.projector]`.
void read_pair_entries(base::TableReader& top, const std::filesystem::path& folder, RigUse use,
                       RigDescription& rig);
/// The path of a registration, relative to the rig file. The file itself may still be missing.
void read_registration(base::TableReader& table, const std::filesystem::path& folder, std::string& file);

/// The sensor's facts for the camera driver, from the rig's description.
inline camera::SensorFacts sensor_facts(const RigDescription& rig) {
  const CameraProfile& profile = rig.setup.camera;
  return {rig.camera.noise,
          rig.camera.bits,
          rig.camera.defects,
          {profile.min_exposure, rig.camera.max_exposure, profile.readout, profile.trigger_delay},
          std::filesystem::path(rig.path).parent_path()};
}

}  // namespace symrig
