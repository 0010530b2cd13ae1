// SPDX-License-Identifier: Apache-2.0
// The table of scenes: its rows, and how to find one.
#pragma once

#include "sim/transport.hpp"
#include "symrig/sim/scene.hpp"

#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace symrig::sim {

/// One operator per channel.
using Channels = std::vector<std::unique_ptr<Transport>>;

/// A scene that `sim:NAME` chooses.
struct SceneRow {
  std::string_view name;
  std::string_view about;  ///< one line
  Channels (*make)(const SceneUri& uri);
  ViewLayout views = {};  ///< coaxial views that tile its grid
};

/// All scenes.
std::span<const SceneRow> scene_table();

/// The scene of that name. nullptr: none has it.
const SceneRow* find_scene(std::string_view name);

/// The error unknown_name. It names the nearest scene, and all scenes.
Error unknown_scene(std::string_view name);

inline constexpr std::int64_t kLargestScene = std::int64_t{1} << 24;  // pixels: 16 Mi, 64 MiB per picture

}  // namespace symrig::sim
