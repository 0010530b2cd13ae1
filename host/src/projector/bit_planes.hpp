// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/projector/projector.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::projector {

/// Packs binary patterns into pictures of words 0x00RRGGBB: plane k of a picture is the bit bits[k] of each
/// word. Planes without a pattern are black. fails: size_mismatch, bad_value, bad_argument (as
/// Projector::load_planes).
Result<std::vector<Image<std::uint32_t>>> pack_planes(std::span<const Pattern> patterns,
                                                      std::span<const PlanePlan> plans, Grid grid,
                                                      std::span<const int> bits);

/// One picture for each pattern: a value v lights the first round(v·n) of n planes. Only exposures of whole
/// refreshes show it as grey.
/// fails: size_mismatch, bad_value (outside [0, 1] or NaN).
Result<std::vector<Image<std::uint32_t>>> spread_over_planes(std::span<const Pattern> patterns, Grid grid,
                                                             std::span<const int> bits);

}  // namespace symrig::projector
