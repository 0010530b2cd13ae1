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

/// A mode as the user asks for it.
struct ModeRequest {
  std::optional<Grid> grid;    // none: the preferred mode
  std::optional<double> rate;  // refreshes a second; none: any
  bool computed = false;       // timings of our own, whatever the display tells
};

/// "", "1920x1080", "1920x1080@60", "1280x720@59.94"; "912x1140R@60" (R: computed, reduced blanking, 60 if no
/// rate is given).  fails: bad_argument.
Result<ModeRequest> parse_mode(const std::string& text);

DisplayMode describe(const drmModeModeInfo& mode);

/// A computed mode, or the first mode of that size, in the kernel's order (preferred first, then fast before
/// slow); with a rate the one nearest to it, at most half a hertz away. Interlaced and double-scan modes are
/// left out: their lines are not the projector's.  fails: unknown_name (lists what there is), device_lost (no
/// mode at all).
Result<drmModeModeInfo> choose_mode(std::span<const drmModeModeInfo> modes, const ModeRequest& request,
                                    const std::string& connector);

/// Timings for a size and rate that a display does not tell: VESA Coordinated Video Timings 1.2, reduced
/// blanking (version 1). The clock is a multiple of 0.25 MHz, so the rate is met from below, within 0.25 MHz
/// of the clock. rate: refreshes a second, positive.
drmModeModeInfo reduced_blanking_mode(Grid grid, double rate);

}  // namespace symrig::projector::drm
