// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/exchange.hpp"

#include <memory>

namespace symrig::sim {

/// Exchange of a groove with two thin opaque fins. The rig sees both edge-on, so they are invisible and shade
/// no direct light:
///   - one across the groove at 37 % of its height, as tall as the groove: no light passes it;
///   - one below it along the crease, between 4 % and 15 % of the width above the crease. It hides (s, t) if
///     their connecting line crosses the plane of the crease in this range, at height 2 s t / (s + t).
/// Light passes below the second fin near the crease, and above it far from the crease.
std::unique_ptr<Exchange> occluded_exchange(const Groove& groove);

/// True if the second fin does not hide s and t from each other.
bool passes_hovering_fin(const Groove& groove, double s, double t);
/// First row below the fin across the groove.
int row_of_cross_fin(const Groove& groove);

}  // namespace symrig::sim
