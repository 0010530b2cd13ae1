// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/camera/camera.hpp"

#include <optional>
#include <span>

namespace symrig {

/// Electrons per second of the brightest live pixel, from one frame. Nothing if it is saturated.
/// The largest of n noisy samples lies a few sigmas high: the estimate errs to the safe side.
std::optional<double> brightest_rate(const CameraFrame& frame, Nanoseconds exposure, const Camera& camera,
                                     double scale);

/// From the frames of a geometric bracket, shortest first: the rate of the longest unsaturated one.
std::optional<double> brightest_rate(std::span<const CameraFrame> frames,
                                     std::span<const Nanoseconds> exposures, const Camera& camera,
                                     double scale);

/// The exposure at which a pixel of this rate [e⁻/s] fills 1 / headroom of the range.
Nanoseconds exposure_for(double rate, double headroom, const NoiseModel& noise);

}  // namespace symrig
