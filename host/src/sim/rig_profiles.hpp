// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/boards/sim_board.hpp"
#include "symrig/boards/sim_peripherals.hpp"
#include "symrig/program/program_file.hpp"
#include "symrig/rig/rig.hpp"
#include "symrig/sim/scene.hpp"

namespace symrig::sim {

/// The profile that the key `profile` names.
const RigProfile& profile_of(const SceneUri& uri);

/// The light that reaches the camera, by the key `light` and the profile. Full light: 1.
double transmission_of(const SceneUri& uri);

/// The line of the plane trigger, in profiles with bit planes.
inline constexpr const char* kPlaneLine = "plane_trigger";

/// The rig that the board's programs are compiled for.
RigSetup setup_of(const RigProfile& profile);

/// What the profile's camera says of itself.
CameraTiming timing_of(const RigProfile& profile);

/// How a simulated rig takes photographs of this scene.
RigOptions options_of(const SceneUri& uri);

// The devices on the board's lines.
board_sim::SimProjectorConfig raster_of(const RigProfile& profile);
board_sim::SimPlaneProjectorConfig planes_of(const RigProfile& profile);
board_sim::SimBoardConfig board_of(const RigProfile& profile);
board_sim::SimCameraConfig shutter_of(const RigProfile& profile);

}  // namespace symrig::sim
