// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

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

}  // namespace symrig::sim::drawn
