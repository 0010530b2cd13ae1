// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/registration.hpp"

namespace symrig::calibration {

/// Registers a camera with pixels of its own on a rig of several views. The map is one smooth map for the
/// whole picture, because camera and projector share their axis and so every mirror.
///
/// The Gray code is shown in one view after another. Which view a pixel belongs to is found first
/// (OwnViews::find), and again from the map. Photographs: for each view one, and one for each bit that
/// changes inside its tile; and four of the flood-lit scene. Ghosts and blurs are not looked for, because the
/// light of other views looks like both.
/// fails: as fit_camera_maps, OwnViews::find and check_maps; interrupted; as the rig.
Result<Registration> register_views(Probe& rig, const RegistrationOptions& options);

}  // namespace symrig::calibration
