// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/drawn/recipe.hpp"
#include "sim/light/transport.hpp"

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace symrig::sim::drawn {

/// The nearest point of the scene along a ray.
struct Sighting {
  int body = -1;
  double distance = 0;
  Vec at, normal;
  int face = 0;
};

/// The surface point that the rig sees at one point of the grid. body < 0: it sees nothing.
struct SeenPoint {
  int body = -1;
  int surface = -1;  ///< smooth parts have one number each: a face of a box, a ball, a plane
  Vec at, normal;
  /// Cosine between the normal and the axis of the rig. At least kSteepest.
  double cosine = 1;
};

/// Steeper surfaces are treated as if they were this steep: a point of the grid covers at most 1/kSteepest of
/// surface.
inline constexpr double kSteepest = 0.1;

/// [points] The rig is this far away. No scene is as deep.
inline constexpr double kRigDistance = 1e6;

/// What the rig sees, point by point in raster order. It looks along −z from far away.
std::vector<SeenPoint> survey(const Recipe& recipe, Grid grid);

/// The nearest body that the rig can see along a ray from a surface, `but` one.
std::optional<Sighting> look(const Recipe& recipe, const Vec& from, const Vec& direction, int but);

/// True if no body, except the two of the ends, is between them.
bool sees(const Recipe& recipe, const Vec& from, int from_body, const Vec& to, int to_body);

}  // namespace symrig::sim::drawn
