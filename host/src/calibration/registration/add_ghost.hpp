// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/calibration/registration.hpp"

#include <functional>
#include <span>
#include <vector>

namespace symrig::calibration {

/// Where a ghost is looked for: a rig of one view, and what is known of its registration.
struct GhostPlace {
  Probe& rig;
  const Registration& known;
};

/// Looks for a ghost. Subtracts it from photographs of the Gray code, and fits the maps again.
/// photographs: each list belongs to one light, such as that of one view. fit: fits the maps of `found` to
/// them.
/// fails: as measure_ghost and fit.
Result<void> add_ghost(const GhostPlace& where, std::span<std::vector<Radiance>> photographs,
                       const std::function<Result<void>()>& fit, const Progress& progress,
                       Registration& found);

}  // namespace symrig::calibration
