// SPDX-License-Identifier: Apache-2.0
#include "calibration/camera_fit/bounded_least_squares.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace symrig::calibration {

// Each value is either at its bound or free. The free ones solve their equations; then the signs show which
// values are on the wrong side: free ones below their bound, and bound ones whose gradient pulls them up.
// All wrong values change sides at once. That nearly always ends after two or three rounds. It may run in a
// circle, so after a few rounds that make no progress only the last wrong value changes sides, which ends
// (Murty's rule).

namespace {

constexpr double kNegligible = 1e-3;  ///< of a sum of squares whose unit is the noise
constexpr double kOutside = 1e-4;     ///< beyond a bound, until the end: rounding is not taken for a fault

}  // namespace

void BoundedLeastSquares::solve_free(const Eigen::MatrixXd& a, const Eigen::VectorXd& h,
                                     const Eigen::VectorXd& least) {
  const Eigen::Index n = h.size();
  free_.clear();
  for (int k = 0; k < n; ++k)
    if (bound_[k] == 0) free_.push_back(k);
  x_ = least;
  const auto count = static_cast<Eigen::Index>(free_.size());
  among_free_.resize(count, count);
  rhs_.resize(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) among_free_(i, j) = a(free_[i], free_[j]);
    double known = 0;
    for (int k = 0; k < n; ++k)
      if (bound_[k] != 0) known += a(std::max(free_[i], k), std::min(free_[i], k)) * least(k);
    rhs_(i) = h(free_[i]) - known;
  }
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Lower> factor(among_free_);
  // Photographs without noise may drown the identity in rounding: then the values stay where they were told.
  if (factor.info() != Eigen::Success)
    rhs_.setZero();
  else
    factor.solveInPlace(rhs_);
  for (Eigen::Index i = 0; i < count; ++i) x_(free_[i]) = rhs_(i);
}

void BoundedLeastSquares::find_wrong(const Eigen::MatrixXd& a, const Eigen::VectorXd& h,
                                     const Eigen::VectorXd& least) {
  gradient_.noalias() = a.selfadjointView<Eigen::Lower>() * x_ - h;
  wrong_.clear();
  for (int k = 0; k < h.size(); ++k) {
    // To free a value, while the others stay, lowers the sum by gradient² / 2 a_kk.
    const double slack = std::sqrt(2 * kNegligible * a(k, k));
    const bool below = bound_[k] == 0 && x_(k) < least(k) - kOutside;
    if (below || (bound_[k] != 0 && gradient_(k) < -slack)) wrong_.push_back(k);
  }
}

const Eigen::VectorXd& BoundedLeastSquares::solve(const Eigen::MatrixXd& a, const Eigen::VectorXd& h,
                                                  const Eigen::VectorXd& least) {
  // Values whose bound is their mean are mostly light that is not there.
  bound_.resize(h.size());
  for (int k = 0; k < h.size(); ++k) bound_[k] = least(k) == 0 ? 1 : 0;
  std::size_t fewest = bound_.size() + 1;
  int patience = 3;
  for (std::size_t round = 0; round < 20 * (bound_.size() + 1); ++round) {
    solve_free(a, h, least);
    find_wrong(a, h, least);
    if (wrong_.empty()) break;
    if (wrong_.size() < fewest) {
      fewest = wrong_.size();
      patience = 3;
    } else {
      --patience;
    }
    if (patience >= 0)
      for (const int k : wrong_) bound_[k] ^= 1;
    else
      bound_[wrong_.back()] ^= 1;
  }
  x_ = x_.cwiseMax(least);
  return x_;
}

}  // namespace symrig::calibration
