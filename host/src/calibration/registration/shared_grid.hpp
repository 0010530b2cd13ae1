// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/registration.hpp"

namespace symrig::calibration {

/// Registers a camera that has a pixel for each cell: finds its shift with the axis check (check_coaxial). A
/// shift is known to a tenth of itself, so the check is repeated on the corrected rig, at most twice.
/// A ghost is looked for and subtracted, and the shift found again, if the rig has one view: the light of
/// other views looks like a ghost.
/// Photographs: 8 for each check, one of the flood-lit scene, and 6 for a ghost.
/// fails: as check_coaxial and measure_ghost; bad_value (too dark to be checked); limit (shifted too far).
Result<Registration> register_shared_grid(Probe& rig, const RegistrationOptions& options);

}  // namespace symrig::calibration
