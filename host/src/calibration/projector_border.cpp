// SPDX-License-Identifier: Apache-2.0
#include "calibration/raw_map.hpp"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

/// [projector pixels] Blurred light of the border's pixels, seen from beyond it, spells a position within
/// this distance of the border: the mean of a Gaussian's tail is less than two sigmas from where it is cut.
constexpr float kBand = 2.5F;

bool in_band(float position, int size) {
  return position < kBand - 0.5F || position > static_cast<float>(size) - kBand - 0.5F;
}

/// Whether positions further inside predict the pixel's own one.
bool predicted_from_inside(const RawMap& map, std::size_t axis, int size, int row, int col,
                           const Neighbourhood& hood, double distance) {
  const auto& position = map.position[axis];
  const float own = position.at(row, col);
  const Plane plane = fit_plane(position, map.mask, row, col, static_cast<double>(own), hood,
                                [&](int r, int c) { return !in_band(position.at(r, c), size); });
  return plane.support > 0 && std::abs(plane.value - static_cast<double>(own)) <= distance;
}

}  // namespace

void drop_beyond_border(RawMap& map, const GrayCode& code, double distance) {
  const Grid grid = map.grid();
  const double scale = typical_scale(map);
  const int spacing = std::max(1, static_cast<int>(std::lround(1 / scale)));
  const Neighbourhood hood{.reach = 5, .spacing = spacing, .scale = scale, .least = 6};
  Image<std::uint8_t> kept = map.mask;
  tbb::parallel_for(0, grid.rows, [&](int row) {
    for (int col = 0; col < grid.cols; ++col) {
      if (!map.mask.at(row, col)) continue;
      for (const StripeAxis which : {StripeAxis::columns, StripeAxis::rows}) {
        if (code.bits(which) == 0) continue;
        const std::size_t axis = axis_index(which);
        const int size = which == StripeAxis::columns ? code.projector().cols : code.projector().rows;
        if (in_band(map.position[axis].at(row, col), size) &&
            !predicted_from_inside(map, axis, size, row, col, hood, distance))
          kept.at(row, col) = 0;
      }
    }
  });
  map.mask = std::move(kept);
}

}  // namespace symrig::calibration
