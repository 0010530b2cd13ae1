// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/projector/display.hpp"

#include <optional>
#include <span>
#include <string>

#include <xf86drmMode.h>

namespace symrig::projector::drm {

/// The mode that the user asks for.
struct ModeRequest {
  std::optional<Grid> grid;    // none: the preferred mode
  std::optional<double> rate;  // refreshes a second; none: any
  bool computed = false;       // computed timings, whatever the display lists
};

/// "", "1920x1080", "1920x1080@60", "1280x720@59.94", "912x1140R@60". R: computed timings with reduced
/// blanking, at 60 if no rate is given.
/// fails: bad_argument.
Result<ModeRequest> parse_mode(const std::string& text);

DisplayMode describe(const drmModeModeInfo& mode);

/// Returns a computed mode, or the first mode of this size in the kernel's order (preferred first, then fast
/// before slow). With a rate: the mode with the nearest rate, at most 0.5 Hz away. Skips interlaced and
/// double-scan modes, because their lines differ from the projector's.
/// fails: unknown_name (lists the modes), device_lost (no modes).
Result<drmModeModeInfo> choose_mode(std::span<const drmModeModeInfo> modes, const ModeRequest& request,
                                    const std::string& connector);

/// Timings for a size and rate that the display does not list: VESA Coordinated Video Timings 1.2, reduced
/// blanking (version 1). The pixel clock is a multiple of 0.25 MHz, rounded down, so the rate may be slightly
/// low. rate: refreshes a second, positive.
drmModeModeInfo reduced_blanking_mode(Grid grid, double rate);

}  // namespace symrig::projector::drm
