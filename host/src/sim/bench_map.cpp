// SPDX-License-Identifier: Apache-2.0
#include "sim/bench_map.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace symrig::sim {

BenchMap::BenchMap(const SceneUri& uri, Depth depth)
    : cells_(uri.size),
      camera_(uri.camera),
      depth_(depth),
      cells_per_pixel_(std::max(static_cast<double>(cells_.rows) / camera_.rows,
                                static_cast<double>(cells_.cols) / camera_.cols)),
      half_diagonal_(0.5 * std::hypot(cells_.rows, cells_.cols)),
      cos_(std::cos(uri.turn * std::numbers::pi / 180)),
      sin_(std::sin(uri.turn * std::numbers::pi / 180)),
      zoom_(uri.zoom),
      distortion_(uri.distortion),
      parallax_(uri.parallax),
      shift_{uri.shift.row + uri.misalign, uri.shift.col + uri.misalign} {
  // Red and blue are `colour` apart at the corner. One channel is the one in the middle.
  if (uri.channels == 3)
    magnify_ = {1 + 0.5 * uri.colour / half_diagonal_, 1, 1 - 0.5 * uri.colour / half_diagonal_};
}

Point BenchMap::look(Point camera, int channel, double moved) const {
  const double y = (camera.row - 0.5 * camera_.rows) * cells_per_pixel_;
  const double x = (camera.col - 0.5 * camera_.cols) * cells_per_pixel_;
  const double from_axis = (y * y + x * x) / (half_diagonal_ * half_diagonal_);
  const double scale = (1 + distortion_ * from_axis) / zoom_ * magnify_[static_cast<std::size_t>(channel)];
  return seen_at({0.5 * cells_.rows + shift_.row + moved + scale * (cos_ * y + sin_ * x),
                  0.5 * cells_.cols + shift_.col + moved + scale * (cos_ * x - sin_ * y)});
}

/// Solves p + (0, parallax · depth(p)) = q. A cell changes the depth little, so each round gains digits.
Point BenchMap::seen_at(Point q) const {
  if (parallax_ == 0) return q;
  Point p = q;
  constexpr int kRounds = 60;
  for (int round = 0; round < kRounds; ++round) {
    const double col = q.col - parallax_ * depth_(cells_, p);
    const bool settled = std::abs(col - p.col) < 1e-12;
    p.col = col;
    if (settled) break;
  }
  return p;
}

}  // namespace symrig::sim
