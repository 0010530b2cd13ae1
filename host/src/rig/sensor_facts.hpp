// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "camera/driver.hpp"
#include "symrig/rig/rig_description.hpp"

namespace symrig {

/// The sensor's facts for the camera driver, from the rig's description.
inline camera::SensorFacts sensor_facts(const RigDescription& rig) {
  const CameraProfile& profile = rig.setup.camera;
  return {rig.camera.noise,
          rig.camera.bits,
          rig.camera.defects,
          {profile.min_exposure, rig.camera.max_exposure, profile.readout, profile.trigger_delay}};
}

}  // namespace symrig
