// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/rig/frame_taker.hpp"
#include "symrig/rig/pairs.hpp"
#include "symrig/rig/rig_description.hpp"

#include <memory>

namespace symrig {

/// Functions that open the devices of a rig file.
RigDevices devices_of(const RigDescription& file);

/// The cells of all pairs of a rig file. needs: file.grid.
PairLayout pair_layout_of(const RigDescription& file);

/// Opens the devices of a rig file, and opens them again after a loss.
/// fails: as Rig::open() and the devices' own open().
Result<std::unique_ptr<Rig>> open_rig_file(RigDescription file);

/// The devices of a rig file that was read with RigUse::sensor.
struct SensorParts {
  RigParts parts;
  bool whole_picture =
      true;  ///< frames show all pixels of the camera's picture, so defects have their places
};
/// fails: bad_argument (frames are binned on this computer: a code is then no sample of the sensor).
Result<SensorParts> parts_for_sensor(RigDescription file);

}  // namespace symrig
