// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace symrig::calibration {

// Normal equations N x = r of a few unknowns; N is symmetric and not negative. Eigen's factorisations are
// templates, and each size takes the compiler seconds; so they are compiled here once, for every size. Where
// a system is solved for each pixel or cell, the caller uses a fixed size.

/// N⁻¹ r by a Cholesky factorisation with pivots. normal: n×n; right: n×k. Not finite where N is singular.
Eigen::MatrixXd solve_normal(const Eigen::Ref<const Eigen::MatrixXd>& normal,
                             const Eigen::Ref<const Eigen::MatrixXd>& right);

/// The shortest x of least |N x - r|, by a complete orthogonal decomposition. N may be singular.
Eigen::VectorXd solve_shortest(const Eigen::Ref<const Eigen::MatrixXd>& normal,
                               const Eigen::Ref<const Eigen::VectorXd>& right);

/// N⁻¹, or an empty matrix if N is singular within rounding.
Eigen::MatrixXd inverse_if_regular(const Eigen::Ref<const Eigen::MatrixXd>& normal);

}  // namespace symrig::calibration
