// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/job/rig_by_name.hpp"
#include "symrig/rig/rig_description.hpp"

namespace symrig::job {

/// Opens a rig of several pairs: devices of this computer or behind servers, or simulated pairs behind
/// servers.
/// fails: as PairLink::open, open_simulated_pairs, load_registration and Rig::open; bad_argument (the board
/// does not fit, or the grid is missing).
Result<OpenedRig> open_pairs(RigDescription file);

}  // namespace symrig::job
