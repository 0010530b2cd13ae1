// SPDX-License-Identifier: Apache-2.0
#include "sim/drawn/reflections.hpp"

#include <algorithm>
#include <cmath>

namespace symrig::sim::drawn {

namespace {

constexpr int kRays = 2;  // per point and axis

/// The points around a place that show the same surface, with bilinear weights. Weights of other surfaces are
/// lost.
void add_landing(std::span<const SeenPoint> seen, Grid grid, const Vec& at, int body, double weight,
                 Optics& optics) {
  const double top = std::floor(at.y - 0.5), left = std::floor(at.x - 0.5);
  for (int k = 0; k < 4; ++k) {
    const int down = k / 2, right = k % 2;
    const double row = top + down, col = left + right;
    if (row < 0 || col < 0 || row >= grid.rows || col >= grid.cols) continue;
    const auto point = static_cast<std::int64_t>(row) * grid.cols + static_cast<std::int64_t>(col);
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
  const auto above = look(recipe, {landing->at.x, landing->at.y, kRigDistance}, -1 * kToRig, -1);
  if (!above || above->body != landing->body || above->face != landing->face) return;
  add_landing(seen, grid, landing->at, landing->body, weight, optics);
}

/// The rays of a point that shows a mirror.
void add_rays(const Recipe& recipe, std::span<const SeenPoint> seen, Grid grid, std::size_t point,
              Optics& optics) {
  const auto cols = static_cast<std::size_t>(grid.cols);
  const auto row = static_cast<int>(point / cols), col = static_cast<int>(point % cols);
  const double weight =
      recipe.bodies[static_cast<std::size_t>(seen[point].body)].finish.mirror / (kRays * kRays);
  for (int down = 0; down < kRays; ++down)
    for (int right = 0; right < kRays; ++right)
      add_ray(recipe, seen, grid, {col + (right + 0.5) / kRays, row + (down + 0.5) / kRays, kRigDistance},
              weight, optics);
}

}  // namespace

std::shared_ptr<const Optics> reflections(const Recipe& recipe, std::span<const SeenPoint> seen, Grid grid) {
  const auto reflects = [&recipe](const SeenPoint& point) {
    return point.body >= 0 && recipe.bodies[static_cast<std::size_t>(point.body)].finish.mirror > 0;
  };
  if (std::none_of(seen.begin(), seen.end(), reflects)) return nullptr;
  auto optics = std::make_shared<Optics>(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (reflects(seen[i]))
      add_rays(recipe, seen, grid, i, *optics);
    else
      optics->add(static_cast<std::int64_t>(i), 1);
    optics->end_pixel();
  }
  return optics;
}

}  // namespace symrig::sim::drawn
