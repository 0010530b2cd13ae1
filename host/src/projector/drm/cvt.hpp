// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/grid.hpp"

#include <xf86drmMode.h>

namespace symrig::drm {

/// Timings for a size and rate that the display does not list: VESA Coordinated Video Timings 1.2, reduced
/// blanking (version 1). The pixel clock is a multiple of 0.25 MHz, rounded down, so the rate may be slightly
/// low. rate: refreshes a second, positive.
drmModeModeInfo reduced_blanking_mode(Grid grid, double rate);

}  // namespace symrig::drm
