// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/program/program_file.hpp"
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

}  // namespace symrig::sim
