// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/registration.hpp"

namespace symrig::calibration {

/// Registers a camera that has a pixel for each cell: finds its shift with the axis check (check_coaxial). A
/// shift is known to a tenth of itself, so the check is repeated on the corrected rig, at most twice.
/// Photographs: 8 for each check, and one of the flood-lit scene.
/// fails: as check_coaxial; bad_value (too dark to be checked); limit (shifted too far).
Result<Registration> register_shared_grid(Probe& rig, const RegistrationOptions& options);

}  // namespace symrig::calibration
