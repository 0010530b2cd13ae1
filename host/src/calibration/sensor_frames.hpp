// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/sensor_folder.hpp"
#include "symrig/hdr/merge.hpp"

#include <optional>
#include <vector>

namespace symrig {

/// The bracket as frames, which refer to the photographs.
std::vector<Frame> bracket_of(const SensorPhotographs& photographs);

/// The range of usable codes: codes below it are dark, codes above it are clipped. sensor: if it is measured.
ResponseOptions usable_codes(const SensorPhotographs& photographs, const std::optional<Sensor>& sensor);

}  // namespace symrig
