// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <string>

namespace symrig::apps {

/// `symrig calibrate --sensor DIR`: measures a camera's sensor from dark and flat frames.
struct SensorCalibration {
  std::string folder;
  std::string output;    ///< sensor.toml; empty: only printed
  std::string response;  ///< response.toml; empty: only printed
  std::string json;
};

/// fails: as read_sensor_folder and examine_sensor; bad_value (these frames do not give a file that was asked
/// for).
Result<void> calibrate_sensor(const SensorCalibration& asked);

}  // namespace symrig::apps
