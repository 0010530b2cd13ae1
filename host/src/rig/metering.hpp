// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/camera/camera.hpp"
#include "symrig/rig/frame_reading.hpp"

#include <optional>
#include <span>

namespace symrig {

/// Electrons per second of the brightest live pixel, from a geometric bracket with the shortest frame first.
/// Uses the longest unsaturated frame.
std::optional<double> brightest_rate(const FrameReading& reading, std::span<const CameraFrame> frames,
                                     std::span<const Nanoseconds> exposures, const Camera& camera,
                                     double scale);

/// The exposure in which a pixel with this rate [e⁻/s] fills 1 / headroom of the range.
Nanoseconds exposure_for(double rate, double headroom, const NoiseModel& noise);

}  // namespace symrig
