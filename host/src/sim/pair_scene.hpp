// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/rig/pairs.hpp"
#include "symrig/sim/scene.hpp"

#include <string_view>

namespace symrig::sim {

/// A scene in front of several pairs.
struct PairScene {
  SceneUri uri;
  PairLayout layout;
};
/// fails: as parse_scene_uri; bad_argument (pairs cannot have this scene).
Result<PairScene> parse_pair_scene(std::string_view uri, ViewLayout pairs);

}  // namespace symrig::sim
