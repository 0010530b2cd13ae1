// SPDX-License-Identifier: Apache-2.0
#include "sim/groove.hpp"

#include <cmath>

namespace symrig::sim {

Groove::Groove(Grid grid_) : grid(grid_), crease(0.47 * grid_.cols) {
  for (int col = 0; col < grid.cols; ++col) {
    const double x = col + 0.5;
    if (x < crease) ++left_cols;
    distance.push_back(std::abs(x - crease));
  }
}

double point_form_factor(double s, double t, double dy) {
  const double r2 = 2 * s * s + 2 * t * t + dy * dy;
  return r2 > 0 ? kFormFactorScale * s * t / (r2 * r2) : 0;
}

}  // namespace symrig::sim
