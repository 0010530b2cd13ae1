// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/sensor_folder.hpp"
#include "symrig/hdr/merge.hpp"

#include <optional>
#include <span>
#include <vector>

namespace symrig {

/// The bracket as frames, which refer to the photographs.
std::vector<Frame> bracket_of(const SensorPhotographs& photographs);

/// The code at which the longer frames of a bracket stay although the shorter ones expect more light.
std::optional<int> clipping_of(std::span<const Frame> bracket, const std::optional<Sensor>& sensor);

/// Lets a sensor clip where the bracket shows it, if its noise model says that it clips later. Returns
/// whether it did.
bool clip_as_seen(std::span<const Frame> bracket, Sensor& sensor);

/// The range of usable codes: codes below it are dark, codes above it are clipped. sensor: if it is measured.
ResponseOptions usable_codes(const SensorPhotographs& photographs, const std::optional<Sensor>& sensor);

}  // namespace symrig
