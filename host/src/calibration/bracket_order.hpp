// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/calibration/sensor_folder.hpp"

namespace symrig::calibration {

/// A longer exposure of a still scene is brighter, whatever the camera's curve is. Compares each exposure
/// with the next one that is at least 1.5 times as long, pixel by pixel, before anything is fitted. No
/// verdict where fewer than 100 pixels tell. fails: bad_value (the longer one is darker; or both are equally
/// bright in their middle tones).
Result<void> check_bracket_order(const SensorPhotographs& photographs);

}  // namespace symrig::calibration
