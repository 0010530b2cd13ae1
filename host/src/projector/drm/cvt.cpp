// SPDX-License-Identifier: Apache-2.0
#include "projector/drm/mode.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <fmt/format.h>

namespace symrig::projector::drm {
namespace {

// VESA CVT 1.2, chapter 5.4: reduced blanking.
constexpr double kMinVerticalBlank = 460e-6;  // seconds
constexpr int kHorizontalBlank = 160, kHorizontalFront = 48, kHorizontalSync = 32;
constexpr int kVerticalFront = 3, kMinVerticalBack = 6;
constexpr double kClockStep = 250;  // kHz

/// The width of the vertical sync encodes the aspect ratio (CVT 1.2, table 3-2). 10 means any other ratio.
int vertical_sync(Grid grid) {
  const auto is = [&](int width, int height) { return grid.cols * height == grid.rows * width; };
  if (is(4, 3)) return 4;
  if (is(16, 9)) return 5;
  if (is(16, 10)) return 6;
  if (is(5, 4) || is(15, 9)) return 7;
  return 10;
}

}  // namespace

drmModeModeInfo reduced_blanking_mode(Grid grid, double rate) {
  const int sync = vertical_sync(grid);
  const double line = (1 / rate - kMinVerticalBlank) / grid.rows;  // seconds, before rounding to whole lines
  const int blank =
      std::max(static_cast<int>(kMinVerticalBlank / line) + 1, kVerticalFront + sync + kMinVerticalBack);
  const auto u16 = [](int value) { return static_cast<std::uint16_t>(value); };
  drmModeModeInfo mode{};
  mode.hdisplay = u16(grid.cols);
  mode.hsync_start = u16(grid.cols + kHorizontalFront);
  mode.hsync_end = u16(grid.cols + kHorizontalFront + kHorizontalSync);
  mode.htotal = u16(grid.cols + kHorizontalBlank);
  mode.vdisplay = u16(grid.rows);
  mode.vsync_start = u16(grid.rows + kVerticalFront);
  mode.vsync_end = u16(grid.rows + kVerticalFront + sync);
  mode.vtotal = u16(grid.rows + blank);
  const double clock = rate * mode.htotal * mode.vtotal / 1000;
  mode.clock = static_cast<std::uint32_t>(std::floor(clock / kClockStep) * kClockStep);
  mode.vrefresh = static_cast<std::uint32_t>(std::lround(rate));
  mode.flags = DRM_MODE_FLAG_PHSYNC | DRM_MODE_FLAG_NVSYNC;
  mode.type = DRM_MODE_TYPE_USERDEF;
  const auto end = fmt::format_to_n(mode.name, sizeof mode.name - 1, "{}x{}R", grid.cols, grid.rows);
  *end.out = '\0';
  return mode;
}

}  // namespace symrig::projector::drm
