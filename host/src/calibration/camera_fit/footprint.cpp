// SPDX-License-Identifier: Apache-2.0
#include "calibration/camera_fit/footprint.hpp"

#include <cmath>
#include <numbers>

namespace symrig::calibration {
namespace {

/// The light of a point at `x` that falls into each of the cells around cell `middle`, along an axis.
std::array<double, Footprint::side> along(double x, int middle, double blur) {
  const auto below = [&](int border) {
    return 0.5 * std::erfc(-(border - x) / (blur * std::numbers::sqrt2));
  };
  std::array<double, Footprint::side> share{};
  double before = below(middle - Footprint::radius);
  for (int k = 0; k < Footprint::side; ++k) {
    const double after = below(middle - Footprint::radius + k + 1);
    share[k] = after - before;
    before = after;
  }
  return share;
}

/// A point of a quadrangle. u, v: 0 to 1.
Point inside(const Outline& o, double u, double v) {
  const auto mix = [&](double a, double b, double c, double d) {
    return (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * d + u * c);
  };
  return {mix(o[0].row, o[1].row, o[2].row, o[3].row), mix(o[0].col, o[1].col, o[2].col, o[3].col)};
}

}  // namespace

Footprint footprint_of(const Outline& outline, int row, int col, double blur) {
  constexpr int kPoints = 5;
  Footprint footprint;
  for (int i = 0; i < kPoints; ++i)
    for (int j = 0; j < kPoints; ++j) {
      const Point at = inside(outline, (i + 0.5) / kPoints, (j + 0.5) / kPoints);
      const auto rows = along(at.row, row, blur), cols = along(at.col, col, blur);
      for (int y = 0; y < Footprint::side; ++y)
        for (int x = 0; x < Footprint::side; ++x)
          footprint.share[y * Footprint::side + x] += rows[y] * cols[x] / (kPoints * kPoints);
    }
  return footprint;
}

}  // namespace symrig::calibration
