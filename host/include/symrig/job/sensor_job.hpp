// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/calibration/sensor_folder.hpp"
#include "symrig/job/rig_by_name.hpp"

#include <filesystem>
#include <string>

namespace symrig {

/// The measurement of a rig's camera: `symrig calibrate --sensor --rig RIG`.
struct SensorJob {
  std::string rig;             ///< sim:… or a rig file
  std::filesystem::path keep;  ///< folder for the frames; empty: they are not kept
  Progress progress;
  KeepWaiting keep_waiting;
};

struct RigSensor {
  MeasuredSensor measured;
  std::int64_t frames = 0;        ///< exposures that the camera made
  double rig_seconds = 0;         ///< on the rig's clock
  bool defects_left_out = false;  ///< the camera's region is a part of its picture, so defects have no place
  RigTrouble trouble;
};

/// Takes frames of the dark and of the flood-lit scene, and measures the sensor from them.
/// fails: bad_argument (a rig that gives photographs, not frames); as parts_for_sensor, FrameTaker::open,
/// take_sensor_frames, SceneTransfer and SensorRecord.
Result<RigSensor> measure_rig_sensor(const SensorJob& job);

/// The sensor.toml that a rig file names; empty: none, or no rig file.
/// fails: as read_rig_file.
Result<std::string> sensor_file_of(const std::string& rig);

}  // namespace symrig
