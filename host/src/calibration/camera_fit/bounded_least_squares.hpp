// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

namespace symrig::calibration {

/// Solves min ½ xᵀ A x − hᵀ x with x ≥ least, for many small problems one after the other. It keeps its
/// memory. It ends where no bound value can lower the sum by more than a thousandth while the others stay;
/// the unit of a sum of squares is the noise, so nobody would see more.
class BoundedLeastSquares {
 public:
  /// a: symmetric and positive definite, lower triangle. least: −infinity where a value is free.
  /// source: block principal pivoting [Kim11]
  const Eigen::VectorXd& solve(const Eigen::MatrixXd& a, const Eigen::VectorXd& h,
                               const Eigen::VectorXd& least);

 private:
  void solve_free(const Eigen::MatrixXd& a, const Eigen::VectorXd& h, const Eigen::VectorXd& least);
  void find_wrong(const Eigen::MatrixXd& a, const Eigen::VectorXd& h, const Eigen::VectorXd& least);

  Eigen::VectorXd x_, gradient_, rhs_;
  Eigen::MatrixXd among_free_;
  std::vector<char> bound_;
  std::vector<int> free_, wrong_;
};

}  // namespace symrig::calibration
