// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/raw_map.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

namespace symrig::calibration {

/// Normal equations of a plane, summed point by point.
class PlaneSums {
 public:
  void add(double dcol, double drow, double value) {
    const Eigen::Vector3d x(1, dcol, drow);
    a_.noalias() += x * x.transpose();
    b_ += value * x;
    ++count_;
  }
  int count() const { return count_; }
  /// No plane (support 0) if the points lie on a line.
  Plane solve() const {
    const Eigen::LDLT<Eigen::Matrix3d> factor(a_);
    if (factor.vectorD().minCoeff() < 1e-6 * factor.vectorD().maxCoeff()) return {};
    const Eigen::Vector3d x = factor.solve(b_);
    return {x[0], x[1], x[2], count_};
  }

 private:
  Eigen::Matrix3d a_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b_ = Eigen::Vector3d::Zero();
  int count_ = 0;
};

template <class Same>
Plane fit_plane(const Image<float>& position, const Image<std::uint8_t>& mask, int row, int col,
                double centre, const Neighbourhood& hood, Same same) {
  const Grid grid = mask.grid();
  PlaneSums sums;
  for (int i = -hood.reach; i <= hood.reach; ++i) {
    for (int j = -hood.reach; j <= hood.reach; ++j) {
      const int r = row + i * hood.spacing, c = col + j * hood.spacing;
      if (r < 0 || r >= grid.rows || c < 0 || c >= grid.cols || !mask.at(r, c) || !same(r, c)) continue;
      const double step = static_cast<double>(position.at(r, c)) - centre;
      if (std::abs(step) <= hood.largest_step(hood.spacing * std::hypot(i, j)))
        sums.add(j * hood.spacing, i * hood.spacing, step);
    }
  }
  if (sums.count() < hood.least) return {};
  Plane plane = sums.solve();
  plane.value += centre;
  return plane;
}

}  // namespace symrig::calibration
