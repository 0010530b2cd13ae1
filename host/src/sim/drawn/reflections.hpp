// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/drawn/survey.hpp"
#include "sim/optics.hpp"

#include <memory>

namespace symrig::sim::drawn {

/// The mirrors of a scene: a point on a mirror sees, and lights, the points of the picture where its four
/// reflected rays land. A ray is lost if it lands on a mirror, on nothing, or where the rig cannot see it.
/// Other points see themselves. nullptr: the scene has no mirror in sight.
std::shared_ptr<const Optics> reflections(const Recipe& recipe, std::span<const SeenPoint> seen, Grid grid);

}  // namespace symrig::sim::drawn
