// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/exchange.hpp"

#include <memory>

namespace symrig::sim {

/// Exchange of a groove with two thin opaque fins in it. Both stand edge-on to the rig, so that neither is
/// seen nor shades direct light:
///   - one across the groove at 37 % of its height, as tall as the groove: no light passes it;
///   - below it one along the crease, hovering over it between 4 % and 15 % of the width: it hides (s, t)
///   whose
///     connecting line crosses the plane of the crease at such a height, 2 s t / (s + t).
/// Near the crease light passes below the second fin, far from it above.
std::unique_ptr<Exchange> occluded_exchange(const Groove& groove);

/// True where the hovering fin does not hide s and t from each other.
bool passes_hovering_fin(const Groove& groove, double s, double t);
/// First row below the fin across the groove.
int row_of_cross_fin(const Groove& groove);

}  // namespace symrig::sim
