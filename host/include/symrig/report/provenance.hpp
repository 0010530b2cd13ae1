// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace symrig {

/// What makes `rig` another scene than the one that a file says it was captured from (captured_scene(), rigs
/// as Probe::describe() tells them): a fact each; none if light goes the same way in both, or if the file
/// does not say. Of simulated rigs what does not change the true transport does not count: noise, exposures,
/// misalignment, flare, and a seed that no texture comes from.
std::vector<std::string> differences_of_scene(const std::string& captured, const std::string& rig);

}  // namespace symrig
