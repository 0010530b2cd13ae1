// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/camera/camera.hpp"
#include "symrig/rig/rig.hpp"

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
