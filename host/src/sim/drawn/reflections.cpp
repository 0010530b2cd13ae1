// SPDX-License-Identifier: Apache-2.0
#include "sim/drawn/reflections.hpp"

#include <algorithm>
#include <cmath>

namespace symrig::sim::drawn {

namespace {

constexpr double kFar = 1e6;
constexpr int kRays = 2;  // per point and axis

/// The points around a place that show the same surface, with bilinear weights. Weights of other surfaces are
/// lost.
void add_landing(std::span<const SeenPoint> seen, Grid grid, const Vec& at, int body, double weight,
                 Optics& optics) {
  const double top = std::floor(at.y - 0.5), left = std::floor(at.x - 0.5);
  for (int k = 0; k < 4; ++k) {
    const double row = top + k / 2, col = left + k % 2;
    if (row < 0 || col < 0 || row >= grid.rows || col >= grid.cols) continue;
    const std::int64_t point = static_cast<std::int64_t>(row) * grid.cols + static_cast<std::int64_t>(col);
    const double share = (1 - std::abs(at.y - 0.5 - row)) * (1 - std::abs(at.x - 0.5 - col));
    if (share > 0 && seen[static_cast<std::size_t>(point)].body == body)
      optics.add(point, static_cast<float>(weight * share));
  }
}

/// Follows one ray of the rig that passes over (row, col). Adds where it lands after the mirror.
void add_ray(const Recipe& recipe, std::span<const SeenPoint> seen, Grid grid, const Vec& from, double weight,
             Optics& optics) {
  const auto mirror = look(recipe, from, -1 * kToRig, -1);
  if (!mirror || recipe.bodies[static_cast<std::size_t>(mirror->body)].finish.mirror == 0) return;
  const Vec direction = 2 * mirror->normal.z * mirror->normal - kToRig;
  const auto landing = look(recipe, mirror->at, direction, mirror->body);
  if (!landing || recipe.bodies[static_cast<std::size_t>(landing->body)].finish.mirror > 0) return;
  if (!sees(recipe, mirror->at, mirror->body, landing->at, landing->body)) return;  // a fin is between
  const auto above = look(recipe, {landing->at.x, landing->at.y, kFar}, -1 * kToRig, -1);
  if (!above || above->body != landing->body || above->face != landing->face) return;
  add_landing(seen, grid, landing->at, landing->body, weight, optics);
}

}  // namespace

std::shared_ptr<const Optics> reflections(const Recipe& recipe, std::span<const SeenPoint> seen, Grid grid) {
  const auto reflects = [&recipe](const SeenPoint& point) {
    return point.body >= 0 && recipe.bodies[static_cast<std::size_t>(point.body)].finish.mirror > 0;
  };
  if (std::none_of(seen.begin(), seen.end(), reflects)) return nullptr;
  auto optics = std::make_shared<Optics>(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const double row = static_cast<double>(i / static_cast<std::size_t>(grid.cols));
    const double col = static_cast<double>(i % static_cast<std::size_t>(grid.cols));
    for (int k = 0; k < kRays * kRays && reflects(seen[i]); ++k)
      add_ray(recipe, seen, grid, {col + (k % kRays + 0.5) / kRays, row + (k / kRays + 0.5) / kRays, kFar},
              recipe.bodies[static_cast<std::size_t>(seen[i].body)].finish.mirror / (kRays * kRays), *optics);
    if (!reflects(seen[i])) optics->add(static_cast<std::int64_t>(i), 1);
    optics->end_pixel();
  }
  return optics;
}

}  // namespace symrig::sim::drawn
