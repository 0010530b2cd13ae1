// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace symrig {

/// The differences between the scene of `rig` and the scene that a file was captured from (captured_scene();
/// rigs as in Probe::describe()). One text for each difference; none if the light transport is the same, or
/// if the file does not state its scene. For simulated rigs only the true transport counts: noise, exposures,
/// misalignment, flare, and a seed without texture make no difference.
std::vector<std::string> differences_of_scene(const std::string& captured, const std::string& rig);

/// What to warn of where errors are measured on another scene. of: the scene, such as "scene.h5". Empty: no
/// differences.
std::string other_scene_warning(const std::string& of, const std::vector<std::string>& differences);

}  // namespace symrig
