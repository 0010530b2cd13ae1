// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/camera/camera.hpp"
#include "symrig/hdr/bracket_plan.hpp"
#include "symrig/image/radiance.hpp"
#include "symrig/rig/frame_reading.hpp"
#include "symrig/rig/rig.hpp"

#include <optional>
#include <span>

namespace symrig {

/// What the rig's devices allow, as the planner wants it told.
ExposureRules exposure_rules(const RigOptions& options, const CameraTiming& timing);

/// The shortest exposure that camera and projector allow.
Nanoseconds shortest_exposure(const RigOptions& options, const CameraTiming& timing);

/// The next shorter ones that are whole periods, where the projector makes up its light in time.
/// fails: limit (one is shorter than a period).
Result<Exposures> in_whole_periods(Exposures exposures, const RigOptions& options);

/// The radiance that all but one in a thousand valid pixels of a dark photograph stay below; 0 without one.
double black_level(const std::optional<Radiance>& black);

/// Mean variance of the valid pixels.
double mean_variance(const Radiance& photograph);

/// The least noise that any part of the photographs may have: what black must be better than.
double least_noise(const Expectation& expected);

/// How the dark projector is to be photographed so that its error, averaged over as many photographs, adds at
/// most 1/16 to the noise of photographs that are expected so.
Expectation expected_black(const Radiance& black, const Expectation& of_photographs, int photographs);

/// Electrons per second of the brightest live pixel, from the frames of a geometric bracket, shortest first:
/// the rate of the longest unsaturated one.
std::optional<double> brightest_rate(const FrameReading& reading, std::span<const CameraFrame> frames,
                                     std::span<const Nanoseconds> exposures, const Camera& camera,
                                     double scale);

/// The exposure at which a pixel of this rate [e⁻/s] fills 1 / headroom of the range.
Nanoseconds exposure_for(double rate, double headroom, const NoiseModel& noise);

}  // namespace symrig
