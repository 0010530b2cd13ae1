// SPDX-License-Identifier: Apache-2.0
#include "calibration/registration/border_pixels.hpp"

#include "symrig/calibration/cell_weights.hpp"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

/// [cells] A neighbour that sees one cell only is not farther from the border. Stripes are two cells wide.
constexpr double kFarthest = 1.5;
/// The neighbours on both sides of the border must differ by this much, of at most 2.
constexpr double kLeastContrast = 0.3;

}  // namespace

BorderPixels::Place BorderPixels::place(Point at) const {
  const double here = surface_(at);
  const double width = std::abs(surface_({at.row + 0.5, at.col}) - surface_({at.row - 0.5, at.col})) +
                       std::abs(surface_({at.row, at.col + 0.5}) - surface_({at.row, at.col - 0.5}));
  return {here, width, static_cast<int>(std::lround(here))};
}

/// The nearest pixel in a direction that does not see the border.
std::optional<std::size_t> BorderPixels::clear_neighbour(int row, int col, bool by_rows, int step,
                                                         const Place& border) const {
  for (int k = 1;; ++k) {
    const int r = row + (by_rows ? k * step : 0), c = col + (by_rows ? 0 : k * step);
    if (r < 0 || c < 0 || r >= camera_.rows || c >= camera_.cols) return std::nullopt;
    const double off = std::abs(surface_({r + 0.5, c + 0.5}) - border.border);
    if (off > kFarthest) return std::nullopt;
    if (off < 0.5 * border.width + 2 * blur_) continue;
    return pixels_.good(index(r, c)) ? std::optional(index(r, c)) : std::nullopt;
  }
}

std::optional<BorderPixels::Balance> BorderPixels::balance(int row, int col, const Place& border) const {
  const double middle_row = row + 0.5, middle_col = col + 0.5;
  const double down = surface_({middle_row + 0.5, middle_col}) - surface_({middle_row - 0.5, middle_col});
  const double right = surface_({middle_row, middle_col + 0.5}) - surface_({middle_row, middle_col - 0.5});
  // One pixel towards the second cell.
  const bool by_rows = std::abs(down) >= std::abs(right);
  const int forward = (by_rows ? down : right) > 0 ? 1 : -1;
  const auto first = clear_neighbour(row, col, by_rows, -forward, border);
  const auto second = clear_neighbour(row, col, by_rows, forward, border);
  if (!first || !second) return std::nullopt;
  const auto of = [&](std::size_t pixel) { return pixels_.balance(pixel, axis_, border.border); };
  const auto sigma_of = [&](std::size_t pixel) { return pixels_.balance_sigma(pixel, axis_, border.border); };
  const auto here = of(index(row, col)), near = of(*first), far = of(*second);
  if (!here || !near || !far || *far - *near < kLeastContrast) return std::nullopt;
  const double share = (*far - *here) / (*far - *near);
  const double sigma =
      std::hypot(sigma_of(index(row, col)), share * sigma_of(*first), (1 - share) * sigma_of(*second));
  return Balance{1 - 2 * share, 2 * sigma / (*far - *near), *here, 0.5 * (*far - *near)};
}

float BorderPixels::share(int row, int col) const {
  const Place here = place({row + 0.5, col + 0.5});
  if (!here.crossed() || here.border <= 0 || here.border >= pixels_.size(axis_)) return 1;
  const auto found = balance(row, col, here);
  if (!found) return kUnknownShare;
  // Light from elsewhere in the scene and light that scatters below the surface do not follow the border:
  // they count by area.
  const double sharp = std::clamp(found->sharp, 0.0, 1.0) * pixels_.follows_all(index(row, col), axis_);
  const double by_light = 0.5 - 0.5 * found->value, by_area = 0.5 + (here.border - here.here) / here.width;
  return static_cast<float>(
      std::clamp(sharp * by_light + (1 - sharp) * std::clamp(by_area, 0.0, 1.0), 0.0, 1.0));
}

void fill_shares(const BorderPixels& borders, Grid camera, std::span<float> shares) {
  tbb::parallel_for(0, camera.rows, [&](int row) {
    for (int col = 0; col < camera.cols; ++col)
      shares[static_cast<std::size_t>(std::int64_t{row} * camera.cols + col)] = borders.share(row, col);
  });
}

}  // namespace symrig::calibration
