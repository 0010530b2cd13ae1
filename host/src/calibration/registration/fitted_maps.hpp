// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/registration.hpp"

#include <span>

namespace symrig::calibration {

/// Replaces the maps and shares of a registration by those that photographs of the Gray code tell.
/// needs: found.cells, found.flood. fails: as fit_camera_maps.
Result<void> fit_maps(std::span<const Radiance> photographs, Registration& found);

/// Whether the maps are good enough for a capture.
/// fails: bad_value (too uncertain, or out of focus); limit (fewer camera pixels than the cells need).
Result<void> check_maps(const Registration& found, const RegistrationOptions& options);

}  // namespace symrig::calibration
