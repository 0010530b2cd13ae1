// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/camera/camera.hpp"
#include "symrig/rig/frame_reading.hpp"

#include <optional>
#include <span>

namespace symrig {

/// Electrons per second of the brightest live pixel, from the frames of a geometric bracket, shortest first:
/// the rate of the longest unsaturated one.
std::optional<double> brightest_rate(const FrameReading& reading, std::span<const CameraFrame> frames,
                                     std::span<const Nanoseconds> exposures, const Camera& camera,
                                     double scale);

/// The exposure at which a pixel of this rate [e⁻/s] fills 1 / headroom of the range.
Nanoseconds exposure_for(double rate, double headroom, const NoiseModel& noise);

}  // namespace symrig
