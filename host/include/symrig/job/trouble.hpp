// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/rig/rig.hpp"

#include <string>
#include <vector>

namespace symrig {

/// What went wrong during a capture and was repaired, a line for each; empty: nothing.
std::vector<std::string> repair_lines(const RigTrouble& trouble);

/// The same, and what the rig warns of (rig_warnings()).
std::vector<std::string> trouble_lines(const RigTrouble& trouble);

/// Exposures without a frame, and frames that could not be used.
std::int64_t lost_frames(const FrameCounts& frames);

}  // namespace symrig
