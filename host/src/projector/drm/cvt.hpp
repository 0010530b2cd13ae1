// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/grid.hpp"

#include <xf86drmMode.h>

namespace symrig::projector::drm {

/// Timings for a size and rate that a display does not tell: VESA Coordinated Video Timings 1.2, reduced
/// blanking (version 1). The clock is a multiple of 0.25 MHz, so the rate is met from below, within 0.25 MHz
/// of the clock. rate: refreshes a second, positive.
drmModeModeInfo reduced_blanking_mode(Grid grid, double rate);

}  // namespace symrig::projector::drm
