// SPDX-License-Identifier: Apache-2.0

#include "symrig/projector/internal/drm.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

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

namespace symrig {

std::string to_string(const DisplayMode& mode) {
  const double rate = mode.period.count() > 0 ? 1 / seconds(mode.period) : 0;
  // A mode called 60 may have 60.0004, because the pixel clock has steps.
  const double shown = std::abs(rate - std::round(rate)) < 0.01 ? std::round(rate) : rate;
  return fmt::format("{}x{}@{}{}", mode.grid.cols, mode.grid.rows, std::round(100 * shown) / 100,
                     mode.interlaced ? "i" : "");
}

namespace projector::drm {
namespace {

constexpr double kRateTolerance = 0.5;  // 60 also matches 59.94 if there is no closer mode
constexpr std::size_t kListed = 12;
constexpr double kSlowest = 1, kFastest = 1'000, kUsual = 60;  // refreshes a second
constexpr int kMostComputed = 16'384;                          // rows or columns

template <class T>
bool take_number(std::string_view& text, T& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{}) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return true;
}

bool take(std::string_view& text, char wanted) {
  if (!text.starts_with(wanted)) return false;
  text.remove_prefix(1);
  return true;
}

bool parse(std::string_view text, ModeRequest& request) {
  Grid grid;
  if (!take_number(text, grid.cols) || !take(text, 'x') || !take_number(text, grid.rows) || !grid.valid())
    return false;
  request.grid = grid;
  request.computed = take(text, 'R');
  if (request.computed && (grid.rows > kMostComputed || grid.cols > kMostComputed)) return false;
  if (text.empty()) return true;
  double rate = 0;
  if (!take(text, '@') || !take_number(text, rate) || !(rate >= kSlowest && rate <= kFastest)) return false;
  request.rate = rate;
  return text.empty();
}

/// Lines per refresh, in units of the pixel clock's count.
double lines(const drmModeModeInfo& mode) {
  double count = mode.vtotal;
  if ((mode.flags & DRM_MODE_FLAG_INTERLACE) != 0) count /= 2;
  if ((mode.flags & DRM_MODE_FLAG_DBLSCAN) != 0) count *= 2;
  if (mode.vscan > 1) count *= mode.vscan;
  return count;
}

bool progressive(const drmModeModeInfo& mode) {
  return (mode.flags & (DRM_MODE_FLAG_INTERLACE | DRM_MODE_FLAG_DBLSCAN)) == 0;
}

double rate_of(const drmModeModeInfo& mode) {
  return 1 / seconds(describe(mode).period);
}

/// true: `mode` matches the request, and better than `best`.
bool better(const drmModeModeInfo& mode, const drmModeModeInfo* best, const ModeRequest& request) {
  if (!progressive(mode)) return false;
  if (request.grid && describe(mode).grid != *request.grid) return false;
  if (!request.rate) return best == nullptr;
  const double distance = std::abs(rate_of(mode) - *request.rate);
  return distance <= kRateTolerance &&
         (best == nullptr || distance < std::abs(rate_of(*best) - *request.rate));
}

std::string offered(std::span<const drmModeModeInfo> modes) {
  std::vector<std::string> names;
  for (const auto& mode : modes) {
    const std::string name = to_string(describe(mode));
    if (progressive(mode) && std::find(names.begin(), names.end(), name) == names.end())
      names.push_back(name);
  }
  const std::size_t more = names.size() > kListed ? names.size() - kListed : 0;
  names.resize(names.size() - more);
  return fmt::format("{}{}", fmt::join(names, ", "), more > 0 ? fmt::format(" and {} more", more) : "");
}

std::string request_text(const ModeRequest& request) {
  if (!request.grid) return "progressive mode";
  const std::string size = fmt::format("{}x{}", request.grid->cols, request.grid->rows);
  return "mode " + (request.rate ? fmt::format("{}@{}", size, *request.rate) : size);
}

}  // namespace

Result<ModeRequest> parse_mode(const std::string& text) {
  ModeRequest request;
  if (text.empty() || parse(text, request)) return request;
  return Error{ErrorCode::bad_argument, "'" + text + "' is not a mode",
               "give COLUMNSxROWS or COLUMNSxROWS@RATE, such as 1920x1080@60; an R after the size "
               "computes timings that the display does not list"};
}

DisplayMode describe(const drmModeModeInfo& mode) {
  DisplayMode described;
  described.grid = {mode.vdisplay, mode.hdisplay};
  described.preferred = (mode.type & DRM_MODE_TYPE_PREFERRED) != 0;
  described.interlaced = (mode.flags & DRM_MODE_FLAG_INTERLACE) != 0;
  const double pixels = mode.htotal * lines(mode);  // per refresh; the clock is in kHz
  const double fallback = 1e9 / (mode.vrefresh > 0 ? mode.vrefresh : 60);
  described.period =
      Nanoseconds(std::llround(mode.clock > 0 && pixels > 0 ? pixels * 1e6 / mode.clock : fallback));
  return described;
}

Result<drmModeModeInfo> choose_mode(std::span<const drmModeModeInfo> modes, const ModeRequest& request,
                                    const std::string& connector) {
  if (request.computed) return reduced_blanking_mode(*request.grid, request.rate.value_or(kUsual));
  if (modes.empty())
    return Error{ErrorCode::device_lost, connector + ": the connected display reports no modes",
                 "switch the projector on and connect it again"};
  const drmModeModeInfo* best = nullptr;
  for (const auto& mode : modes)
    if (better(mode, best, request)) best = &mode;
  if (best != nullptr) return *best;
  return Error{ErrorCode::unknown_name, fmt::format("{} has no {}", connector, request_text(request)),
               "it has " + offered(modes)};
}

}  // namespace projector::drm
}  // namespace symrig
