// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/camera/camera.hpp"
#include "symrig/hdr/bracket_plan.hpp"
#include "symrig/image/image.hpp"
#include "symrig/rig/frame_reading.hpp"
#include "symrig/rig/rig.hpp"

#include <optional>
#include <span>

namespace symrig::rig {

/// Takes over what the open camera says: it may be slower than its description, late, or able to overlap.
void adopt_timing(RigOptions& options, const CameraTiming& timing);

/// From the end of an exposure to the next trigger if no exposure overlaps a readout.
Nanoseconds gap_without_overlap(const RigOptions& options);

/// By how much the next trigger may come sooner, at most. 0: the camera does not overlap. What the rig keeps
/// between two exposures beyond the readout is for their ends, so that a stamp fits only one; a trigger may
/// come in it.
Nanoseconds longest_overlap(const RigOptions& options);

/// By how much it may come sooner before this exposure: one that begins during a readout must end after it.
Nanoseconds overlap_before(Nanoseconds exposure, Nanoseconds longest);

}  // namespace symrig::rig

namespace symrig {

/// The limits of the rig's devices and the cost of a frame, for the exposure planner. timing: of camera and
/// projector together.
ExposureRules exposure_rules(const RigOptions& options, const Camera& camera, const CameraTiming& timing);

/// The shortest exposure that camera and projector allow.
Nanoseconds shortest_exposure(const RigOptions& options, const CameraTiming& timing);

/// Shortens each exposure to a whole number of periods, if the projector forms its light over a period.
/// fails: limit (one is shorter than a period).
Result<Exposures> in_whole_periods(Exposures exposures, const RigOptions& options);

/// A radiance that 99.9 % of the valid pixels of a dark photograph do not exceed. 0 without a photograph.
double black_level(const std::optional<Radiance>& black);

/// Mean variance of the valid pixels.
double mean_variance(const Radiance& photograph);

/// The lowest noise in any part of the photographs. The error of black must be lower.
double least_noise(const Expectation& expected);

/// The expectation for photographs of the dark projector. With it, the error of their average adds at most
/// 1/16 to the expected noise of other photographs.
Expectation expected_black(const Radiance& black, const Expectation& of_photographs, int photographs);

/// The expectation of a flood-lit photograph, from the metering's: each part of 3 octaves to 2 % of its RMS
/// radiance, and no pixel better than 1e-4 of the brightest ones. No parts if it is dark.
Expectation expected_flood_lit(const Radiance& metered);

/// Electrons per second of the brightest live pixel, from a geometric bracket with the shortest frame first.
/// Uses the longest unsaturated frame.
std::optional<double> brightest_rate(const FrameReading& reading, std::span<const CameraFrame> frames,
                                     std::span<const Nanoseconds> exposures, const Camera& camera,
                                     double scale);

/// The exposure in which a pixel with this rate [e⁻/s] fills 1 / headroom of the range.
Nanoseconds exposure_for(double rate, double headroom, const NoiseModel& noise);

}  // namespace symrig
