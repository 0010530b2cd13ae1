// SPDX-License-Identifier: Apache-2.0
#include "calibration/fitting/least_squares.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>

namespace symrig::calibration {

Eigen::MatrixXd solve_normal(const Eigen::Ref<const Eigen::MatrixXd>& normal,
                             const Eigen::Ref<const Eigen::MatrixXd>& right) {
  return Eigen::LDLT<Eigen::MatrixXd>(normal).solve(right);
}

Eigen::VectorXd solve_shortest(const Eigen::Ref<const Eigen::MatrixXd>& normal,
                               const Eigen::Ref<const Eigen::VectorXd>& right) {
  return Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(normal).solve(right);
}

Eigen::MatrixXd inverse_if_regular(const Eigen::Ref<const Eigen::MatrixXd>& normal) {
  const Eigen::FullPivLU<Eigen::MatrixXd> factor(normal);
  if (!factor.isInvertible()) return {};
  return factor.inverse();
}

}  // namespace symrig::calibration
