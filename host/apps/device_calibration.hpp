// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <string>

namespace symrig::apps {

/// `symrig calibrate --rig RIG --levels FILE`: measures the light of each level of the rig's projector.
struct LevelCalibration {
  std::string rig;
  std::string output;  ///< levels.toml
  std::string json;
};

/// fails: as open_rig and ProjectorResponse::fit; bad_argument (the rig file already corrects the levels).
Result<void> calibrate_levels(const LevelCalibration& asked);

/// `symrig calibrate --sensor DIR` or `--sensor --rig RIG`: measures a camera's sensor, from frames of a
/// folder or of a rig.
struct SensorCalibration {
  std::string folder;  ///< empty: the rig takes the frames
  std::string rig;
  std::string keep;      ///< folder for the rig's frames; empty: they are not kept
  std::string output;    ///< sensor.toml; empty: the one that the rig file names, or only printed
  std::string response;  ///< response.toml; empty: only printed
  std::string json;
};

/// fails: as measure_sensor_folder or measure_rig_sensor; bad_value (these frames do not give a file that was
/// asked for).
Result<void> calibrate_sensor(SensorCalibration asked);

}  // namespace symrig::apps
