// SPDX-License-Identifier: Apache-2.0
// The table of scenes: its rows, and how to find one.
#pragma once

#include "sim/light/transport.hpp"
#include "sim/view.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/sim/scene.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace symrig::sim {

/// The darkest and the brightest albedo of a texture.
inline constexpr float kDarkest = 0.08F;
inline constexpr float kBrightest = 0.8F;

/// A seeded albedo picture: patches at three scales (a quarter, a tenth, a thirtieth of the longer side) plus
/// grain of one pixel. So it is neither smooth nor sparse at any level of a quadtree. shapes: grid, raster
/// order. values in [kDarkest, kBrightest]. Uses only integer hashes and float +, −, ×, /, so results are
/// bit-equal on all computers. Different keys give unrelated pictures.
std::vector<float> texture(Grid grid, std::uint64_t key);

/// One operator per channel.
using Channels = std::vector<std::unique_ptr<Transport>>;

/// A scene that `sim:NAME` chooses.
struct SceneRow {
  std::string_view name;
  std::string_view about;  ///< one line
  /// uri.size: the grid of the scene's points, uri.fine of them along the side of a cell.
  Channels (*make)(const SceneUri& uri);
  Depth depth;
  ViewLayout views = {};  ///< coaxial views that tile its grid
};

/// The scene of that name. nullptr: none has it.
const SceneRow* find_scene(std::string_view name);

/// A given scene has none.
Depth depth_of(const SceneUri& uri);

/// The error unknown_name. It names the nearest scene, and all scenes.
Error unknown_scene(std::string_view name);

/// The scene with its fine points as the grid: uri.size × uri.fine. make_scene() averages them over the
/// cells. fails: as make_scene.
Result<std::unique_ptr<Scene>> make_points(const SceneUri& uri);

/// T of the cells, from the scene's points: y = Uᵀ S U p / fine². U: the light of a cell falls on all of its
/// points.
std::unique_ptr<Scene> cell_scene(const SceneUri& uri, std::shared_ptr<const Scene> points);

inline constexpr std::int64_t kLargestScene = std::int64_t{1} << 24;  // pixels: 16 Mi, 64 MiB per picture

}  // namespace symrig::sim
