// SPDX-License-Identifier: Apache-2.0
#include "sim/drawn/solid.hpp"

#include <cmath>
#include <limits>

namespace symrig::sim::drawn {

namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

/// The part of a ray that is inside a solid.
struct Inside {
  double begin = -kNever, end = kNever;
  Vec normal;  ///< where it begins
  int face = 0;

  bool empty() const { return begin >= end; }
};

/// Cuts off what is in front of or behind one plane: height + rate · distance ≤ 0 is inside.
void cut(Inside& inside, double height, double rate, const Vec& normal, int face) {
  if (rate == 0) {
    if (height > 0) inside.end = inside.begin;
    return;
  }
  const double at = -height / rate;
  if (rate > 0) {
    inside.end = std::fmin(inside.end, at);
  } else if (at > inside.begin) {
    inside.begin = at;
    inside.normal = normal;
    inside.face = face;
  }
}

Inside within(const HalfSpace& solid, const Vec& from, const Vec& direction) {
  Inside inside;
  cut(inside, dot(solid.normal, from - solid.at), dot(solid.normal, direction), solid.normal, 0);
  return inside;
}

/// Roots of |from + t direction − middle|² = radius².
Inside within(const Ball& ball, const Vec& from, const Vec& direction) {
  const Vec to = from - ball.middle;
  const double a = dot(direction, direction), b = dot(to, direction);
  const double discriminant = b * b - a * (dot(to, to) - ball.radius * ball.radius);
  if (discriminant <= 0) return {0, 0, {}, 0};
  const double root = std::sqrt(discriminant);
  const double begin = (-b - root) / a;
  return {begin, (-b + root) / a, unit(to + begin * direction), 0};
}

Inside within(const Box& box, const Vec& from, const Vec& direction) {
  Inside inside;
  for (int k = 0; k < 3; ++k) {
    const double height = dot(box.axis[k], from - box.middle), rate = dot(box.axis[k], direction);
    cut(inside, height - box.half[k], rate, box.axis[k], 2 * k);
    cut(inside, -height - box.half[k], -rate, -1 * box.axis[k], 2 * k + 1);
  }
  return inside;
}

Inside within(const Solid& solid, const Vec& from, const Vec& direction) {
  return std::visit([&](const auto& one) { return within(one, from, direction); }, solid);
}

}  // namespace

std::optional<Hit> enter(const Solid& solid, const Vec& from, const Vec& direction, double nearest) {
  const Inside inside = within(solid, from, direction);
  if (inside.empty() || !(inside.begin > nearest)) return std::nullopt;
  return Hit{inside.begin, inside.normal, inside.face};
}

bool blocks(const Solid& solid, const Vec& from, const Vec& to) {
  const Inside inside = within(solid, from, to - from);
  return !inside.empty() && std::fmin(inside.end, 1.0) > std::fmax(inside.begin, 0.0);
}

}  // namespace symrig::sim::drawn
