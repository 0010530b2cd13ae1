// SPDX-License-Identifier: Apache-2.0
#include "calibration/fitting/spline_surface.hpp"

#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Sparse>
#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

/// One of the fourth differences of a line of coefficients.
constexpr std::array<double, 5> kFourthDifference{1, -4, 6, -4, 1};

/// Tells the solver what no value tells it, far below every value.
constexpr double kRidge = 1e-10;

}  // namespace

SplineSurface::SplineSurface(Grid picture, int intervals)
    : intervals_(intervals),
      interval_(static_cast<double>(std::max(picture.rows, picture.cols)) / intervals),
      rows_(static_cast<int>(std::ceil(picture.rows / interval_ - 1e-9)) + kOrder - 1),
      cols_(static_cast<int>(std::ceil(picture.cols / interval_ - 1e-9)) + kOrder - 1),
      coefficient_(static_cast<std::size_t>(rows_) * static_cast<std::size_t>(cols_)) {}

/// The uniform cubic B-spline.
SplineSurface::Weights SplineSurface::weights_at(double at, double interval, int intervals) {
  const double scaled = at / interval;
  const int first = std::clamp(static_cast<int>(std::floor(scaled)), 0, intervals - 1);
  const double t = scaled - first, s = 1 - t;
  return {first,
          {s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * s * s * s - 6 * s * s + 4) / 6,
           t * t * t / 6}};
}

double SplineSurface::operator()(Point at) const {
  const Weights down = weights_at(at.row, interval_, rows_ - kOrder + 1);
  const Weights across = weights_at(at.col, interval_, cols_ - kOrder + 1);
  double sum = 0;
  for (int i = 0; i < kOrder; ++i) {
    double line = 0;
    for (int j = 0; j < kOrder; ++j)
      line += across.weight[j] * coefficient_[index(down.first + i, across.first + j)];
    sum += down.weight[i] * line;
  }
  return sum;
}

// Least squares with a penalty, after P-splines [Eilers96]. The surface is f(p) = Σ_k B_k(p) c_k: at each
// point p, 4 × 4 coefficients count. What is least is
//
//   Σ_i w_i (f(p_i) − v_i)²  +  λ Σ (fourth differences of c along rows and columns)²
//
// with λ = smoothing · Σ w / n for n coefficients. Its derivative is 0 where (Bᵀ W B + λ Dᵀ D) c = Bᵀ W v.
// The steps:
// 1. add: Bᵀ W B and Bᵀ W v, value by value. Coefficients more than three rows or columns apart
//    never meet, so each keeps its sums in a square of 7 × 7.
// 2. matrix: these sums, λ Dᵀ D, and a ridge that fixes what neither tells, as one sparse matrix.
// 3. A sparse Cholesky factorisation L D Lᵀ gives c.
class SplineSurface::NormalEquations {
 public:
  NormalEquations(const SplineSurface& surface, std::span<const SeenValue> values)
      : surface_(surface), near_(surface.coefficient_.size()), right_(surface.coefficient_.size(), 0) {
    for (auto& square : near_) square.fill(0);
    for (const SeenValue& seen : values) add(seen);
  }

  Eigen::SparseMatrix<double> matrix(double smoothing) const {
    const auto n = static_cast<Eigen::Index>(near_.size());
    const double each = weight_ / static_cast<double>(n);
    const auto index = [&](int row, int col) { return surface_.index(row, col); };
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(near_.size() * 60);
    for (int row = 0; row < surface_.rows_; ++row)
      for (int col = 0; col < surface_.cols_; ++col) {
        entries.emplace_back(index(row, col), index(row, col), kRidge * each);
        for (int dr = -kReach; dr <= kReach; ++dr)
          for (int dc = -kReach; dc <= kReach; ++dc) {
            const double v = near_[index(row, col)][(dr + kReach) * kSide + dc + kReach];
            if (v != 0) entries.emplace_back(index(row, col), index(row + dr, col + dc), v);
          }
        for (const bool down : {true, false}) {
          if ((down ? row : col) + 4 >= (down ? surface_.rows_ : surface_.cols_)) continue;
          for (int a = 0; a < 5; ++a)
            for (int b = 0; b < 5; ++b)
              entries.emplace_back(down ? index(row + a, col) : index(row, col + a),
                                   down ? index(row + b, col) : index(row, col + b),
                                   smoothing * each * kFourthDifference[a] * kFourthDifference[b]);
        }
      }
    Eigen::SparseMatrix<double> matrix(n, n);
    matrix.setFromTriplets(entries.begin(), entries.end());
    return matrix;
  }
  Eigen::Map<const Eigen::VectorXd> right() const { return {right_.data(), std::ssize(right_)}; }

 private:
  static constexpr int kReach = kOrder - 1, kSide = 2 * kReach + 1;

  void add(const SeenValue& seen) {
    const Weights down = weights_at(seen.at.row, surface_.interval_, surface_.rows_ - kOrder + 1);
    const Weights across = weights_at(seen.at.col, surface_.interval_, surface_.cols_ - kOrder + 1);
    weight_ += seen.weight;
    for (int a = 0; a < kOrder * kOrder; ++a) {
      const int ar = a / kOrder, ac = a % kOrder;
      const std::size_t at = surface_.index(down.first + ar, across.first + ac);
      const double wa = seen.weight * down.weight[ar] * across.weight[ac];
      right_[at] += wa * seen.value;
      for (int b = 0; b < kOrder * kOrder; ++b) {
        const int br = b / kOrder, bc = b % kOrder;
        near_[at][(br - ar + kReach) * kSide + bc - ac + kReach] += wa * down.weight[br] * across.weight[bc];
      }
    }
  }

  const SplineSurface& surface_;
  std::vector<std::array<double, std::size_t{kSide} * kSide>> near_;  // each coefficient with those around it
  std::vector<double> right_;
  double weight_ = 0;  // of all values
};

bool SplineSurface::fit(std::span<const SeenValue> values, double smoothing) {
  if (values.size() < 16) return false;
  const NormalEquations equations(*this, values);
  const Eigen::SparseMatrix<double> matrix = equations.matrix(smoothing);
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(matrix);
  if (factor.info() != Eigen::Success) return false;
  const Eigen::VectorXd solution = factor.solve(equations.right());
  if (!solution.allFinite()) return false;
  std::ranges::copy(solution, coefficient_.begin());
  return true;
}

namespace {

/// |value − surface| in units of what the weights say.
std::vector<double> distances(const SplineSurface& surface, std::span<const SeenValue> values) {
  std::vector<double> off(values.size());
  tbb::parallel_for(std::size_t{0}, values.size(), [&](std::size_t i) {
    off[i] = std::abs(values[i].value - surface(values[i].at)) * std::sqrt(values[i].weight);
  });
  return off;
}

}  // namespace

std::optional<RobustFit> fit_robustly(SplineSurface& surface, std::span<const SeenValue> values,
                                      double smoothing, int rounds, double least_sigma,
                                      std::span<const SeenValue> guesses) {
  std::vector<SeenValue> weighted(values.begin(), values.end());
  weighted.insert(weighted.end(), guesses.begin(), guesses.end());
  RobustFit fit;
  for (int round = 0;; ++round) {
    if (!surface.fit(weighted, smoothing)) return std::nullopt;
    if (round == rounds) return fit;
    const std::vector<double> off = distances(surface, values);
    std::vector<double> sorted = off;
    fit = {std::max(1.4826 * median(sorted), least_sigma), 0};
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double keep = tukey_weight(off[i] / fit.sigma);
      weighted[i].weight = values[i].weight * keep;
      fit.left_out += keep == 0 ? 1 : 0;
    }
    fit.left_out /= static_cast<double>(values.size());
  }
}

}  // namespace symrig::calibration
