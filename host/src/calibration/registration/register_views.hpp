// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/registration.hpp"

namespace symrig::calibration {

/// Registers a camera with pixels of its own on a rig of several views. The map is one smooth map for the
/// whole picture, because camera and projector share their axis and so every mirror.
///
/// The Gray code is shown in one view after another. Which view a pixel belongs to is found first
/// (OwnViews::find), and again from the map. Photographs: for each view one, and one for each bit that
/// changes inside its tile; four of the flood-lit scene; 6 for a ghost; and 8 for the blurs of a picture that
/// is not sharp. Ghost and blurs are those of the view in the middle, by its own light: the light of other
/// views looks like both. They are taken to be the same in all views. A tile of fewer than 12 cells along a
/// side tells no ghost.
/// fails: as fit_camera_maps, OwnViews::find, check_maps, measure_ghost and measure_blur; interrupted; as the
/// rig.
Result<Registration> register_views(Probe& rig, const RegistrationOptions& options);

}  // namespace symrig::calibration
