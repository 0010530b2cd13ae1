// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <string>

namespace symrig::apps {

/// `symrig calibrate --sensor DIR`: what a camera's sensor is, from frames of it alone.
struct SensorCalibration {
  std::string folder;
  std::string output;    ///< sensor.toml; empty: only told
  std::string response;  ///< response.toml; empty: only told
  std::string json;
};

/// fails: as read_sensor_folder and examine_sensor; bad_value (a file was asked for that these frames do not
/// give).
Result<void> calibrate_sensor(const SensorCalibration& asked);

}  // namespace symrig::apps
