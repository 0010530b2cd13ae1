// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

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

/// min xᵀ A x − 2 bᵀ x over x ≥ 0, for a few unknowns, solved millions of times. So it uses plain arrays of a
/// size that the compiler knows. A is symmetric and positive definite; a ridge added to its diagonal can
/// ensure that. Active sets [Lawson74 ch. 23].
template <std::size_t N>
class NonNegative {
 public:
  using Vector = std::array<double, N>;
  using Matrix = std::array<Vector, N>;
  using Set = unsigned;  ///< bit i: unknown i

  static constexpr Set kAll = (1U << N) - 1;

  /// A point of the search: inactive unknowns are 0, the others positive (those of `free` may have any sign).
  struct Point {
    Vector x{};
    Set active = 0;
  };

  /// free: unknowns that may be negative. All arguments but the last two must outlive this object.
  NonNegative(const Matrix& a, const Vector& b, double ridge = 0, Set free = 0)
      : a_(a), b_(b), ridge_(ridge), free_(free) {}

  /// The minimum with all unknowns at 0 that are not `allowed`. from: any starting point; a near one needs
  /// fewer steps to the only minimum.
  Point minimum(Set allowed, Point from) const {
    from.active &= allowed;
    for (std::size_t i = 0; i < N; ++i)
      if (!has(from.active, i)) from.x[i] = 0;
    walk(from);
    constexpr std::size_t kMost = 3 * N;
    for (std::size_t round = 0; round < kMost; ++round) {
      const std::size_t next = asking_most(allowed & ~from.active, from.x);
      if (next == N) break;
      from.active |= 1U << next;
      walk(from);
    }
    return from;
  }

  /// Solves (A + ridge) x = right for the unknowns in `set`, the others 0, by factors L D Lᵀ, row by row.
  Vector solved(Set set, const Vector& right) const {
    std::array<std::size_t, N> at{};
    std::size_t n = 0;
    for (std::size_t i = 0; i < N; ++i)
      if (has(set, i)) at[n++] = i;
    Matrix factor;        // L, below its diagonal of ones
    Vector y{}, inverse;  // of D
    for (std::size_t i = 0; i < n; ++i) {
      Vector scaled;  // a row of L D
      double sum = right[at[i]], pivot = a_[at[i]][at[i]] + ridge_;
      for (std::size_t j = 0; j < i; ++j) {
        scaled[j] = a_[at[i]][at[j]];
        for (std::size_t k = 0; k < j; ++k) scaled[j] -= scaled[k] * factor[j][k];
        factor[i][j] = scaled[j] * inverse[j];
        pivot -= scaled[j] * factor[i][j];
        sum -= factor[i][j] * y[j];
      }
      inverse[i] = 1 / pivot;
      y[i] = sum;
    }
    Vector x{};
    for (std::size_t i = n; i-- > 0;) {
      double sum = y[i] * inverse[i];
      for (std::size_t k = i + 1; k < n; ++k) sum -= factor[k][i] * x[at[k]];
      x[at[i]] = sum;
    }
    return x;
  }

 private:
  static bool has(Set set, std::size_t unknown) { return (set >> unknown & 1U) != 0; }

  /// The unknown of `set` with the steepest descent; N: none descends.
  std::size_t asking_most(Set set, const Vector& x) const {
    std::size_t next = N;
    double most = 0;
    for (std::size_t i = 0; i < N; ++i) {
      if (!has(set, i)) continue;
      double asks = b_[i];
      for (std::size_t j = 0; j < N; ++j) asks -= a_[i][j] * x[j];
      if (asks > 1e-9 * std::abs(b_[i]) && asks > most) next = i, most = asks;
    }
    return next;
  }

  /// Moves to the minimum over the active unknowns. Unknowns that would become negative on the way become
  /// inactive, one by one.
  void walk(Point& point) const {
    while (true) {
      const Vector wanted = solved(point.active, b_);
      double step = 1;
      std::size_t blocks = N;
      for (std::size_t i = 0; i < N; ++i)
        if (has(point.active & ~free_, i) && wanted[i] < 0 && point.x[i] - wanted[i] > 0)
          if (const double s = point.x[i] / (point.x[i] - wanted[i]); s < step || blocks == N)
            step = s, blocks = i;
      if (blocks == N) {
        point.x = wanted;
        return;
      }
      for (std::size_t i = 0; i < N; ++i) point.x[i] += step * (wanted[i] - point.x[i]);
      point.x[blocks] = 0;
      point.active &= ~(1U << blocks);
    }
  }

  const Matrix& a_;
  const Vector& b_;
  double ridge_;
  Set free_;
};

}  // namespace symrig::calibration
