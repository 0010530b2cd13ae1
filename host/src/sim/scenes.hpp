// SPDX-License-Identifier: Apache-2.0
// What the table of scenes holds.
#pragma once

#include "sim/transport.hpp"
#include "symrig/sim/scene.hpp"

#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace symrig::sim {

/// One operator a channel.
using Channels = std::vector<std::unique_ptr<Transport>>;

/// A scene: what `sim:NAME` chooses.
struct SceneRow {
  std::string_view name;
  std::string_view about;  ///< one line
  Channels (*make)(const SceneUri& uri);
  ViewLayout views = {};  ///< coaxial views that tile its grid
};

/// All scenes.
std::span<const SceneRow> scene_table();

/// The scene of that name; none: nullptr.
const SceneRow* find_scene(std::string_view name);

/// unknown_name, with the nearest scene and all that are known.
Error unknown_scene(std::string_view name);

inline constexpr std::int64_t kLargestScene = std::int64_t{1} << 24;  // pixels: 16 Mi, 64 MiB a picture

}  // namespace symrig::sim
