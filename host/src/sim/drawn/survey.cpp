// SPDX-License-Identifier: Apache-2.0
#include "sim/drawn/survey.hpp"

#include <algorithm>

namespace symrig::sim::drawn {

namespace {

constexpr int kFaces = 6;

}  // namespace

std::optional<Sighting> look(const Recipe& recipe, const Vec& from, const Vec& direction, int but) {
  std::optional<Sighting> nearest;
  for (std::size_t k = 0; k < recipe.bodies.size(); ++k) {
    const Body& body = recipe.bodies[k];
    if (body.unseen || static_cast<int>(k) == but) continue;
    const auto hit = enter(body.solid, from, direction, 0);
    if (!hit || (nearest && nearest->distance <= hit->distance)) continue;
    nearest = Sighting{static_cast<int>(k), hit->distance, from + hit->distance * direction, hit->normal,
                       hit->face};
  }
  return nearest;
}

std::vector<SeenPoint> survey(const Recipe& recipe, Grid grid) {
  std::vector<SeenPoint> seen;
  seen.reserve(static_cast<std::size_t>(grid.size()));
  for (int row = 0; row < grid.rows; ++row) {
    for (int col = 0; col < grid.cols; ++col) {
      SeenPoint& point = seen.emplace_back();
      const auto sighting = look(recipe, {col + 0.5, row + 0.5, kRigDistance}, -1 * kToRig, -1);
      if (!sighting) continue;
      point = {sighting->body, kFaces * sighting->body + sighting->face, sighting->at, sighting->normal,
               std::max(kSteepest, sighting->normal.z)};
    }
  }
  return seen;
}

bool sees(const Recipe& recipe, const Vec& from, int from_body, const Vec& to, int to_body) {
  for (std::size_t k = 0; k < recipe.bodies.size(); ++k) {
    const int body = static_cast<int>(k);
    if (body != from_body && body != to_body && blocks(recipe.bodies[k].solid, from, to)) return false;
  }
  return true;
}

}  // namespace symrig::sim::drawn
