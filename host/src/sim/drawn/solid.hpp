// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <optional>
#include <variant>

namespace symrig::sim::drawn {

/// A point or a direction [points of the grid]: x to the right, y down, z towards the rig.
struct Vec {
  double x = 0, y = 0, z = 0;

  friend Vec operator+(const Vec& a, const Vec& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend Vec operator-(const Vec& a, const Vec& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend Vec operator*(double s, const Vec& a) { return {s * a.x, s * a.y, s * a.z}; }
};

inline double dot(const Vec& a, const Vec& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

/// a / |a|. The zero vector stays as it is.
inline Vec unit(const Vec& a) {
  const double length = std::sqrt(dot(a, a));
  return length > 0 ? (1 / length) * a : a;
}

/// The direction from which the rig looks.
inline constexpr Vec kToRig{0, 0, 1};

/// Everything behind a plane. normal: a unit vector that points out of the solid.
struct HalfSpace {
  Vec at, normal;
};

struct Ball {
  Vec middle;
  double radius = 0;
};

/// A box of any orientation. axis: three unit vectors at right angles; half: half of each side.
struct Box {
  Vec middle;
  std::array<Vec, 3> axis;
  std::array<double, 3> half{};
};

/// A convex solid. So a segment between two points of its surface that leaves one of them outwards never
/// meets the solid again.
using Solid = std::variant<HalfSpace, Ball, Box>;

/// Where a ray enters a solid.
struct Hit {
  double distance = 0;  ///< in lengths of the ray's direction
  Vec normal;           ///< a unit vector
  int face = 0;         ///< of a box, 0 to 5
};

/// The first point of `from` + distance · direction, distance > nearest, that enters the solid.
std::optional<Hit> enter(const Solid& solid, const Vec& from, const Vec& direction, double nearest);

/// True if the segment passes through the inside of the solid.
bool blocks(const Solid& solid, const Vec& from, const Vec& to);

}  // namespace symrig::sim::drawn
