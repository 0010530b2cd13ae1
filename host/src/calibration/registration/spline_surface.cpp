// SPDX-License-Identifier: Apache-2.0
#include "calibration/registration/spline_surface.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Sparse>

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

bool SplineSurface::fit(std::span<const SeenValue> values, double smoothing) {
  if (values.size() < 16) return false;
  const auto n = static_cast<Eigen::Index>(coefficient_.size());
  using Entry = Eigen::Triplet<double>;

  // Normal equations. A coefficient meets those at most three rows and three columns away, so the sums of
  // each are kept in a square of 7 × 7.
  constexpr int kReach = kOrder - 1, kSide = 2 * kReach + 1;
  std::vector<std::array<double, std::size_t{kSide} * kSide>> near(coefficient_.size());
  for (auto& square : near) square.fill(0);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
  double total = 0;
  const auto meet = [&](int row, int col, int dr, int dc, double v) {
    near[index(row, col)][(dr + kReach) * kSide + dc + kReach] += v;
  };
  for (const SeenValue& seen : values) {
    const Weights down = weights_at(seen.at.row, interval_, rows_ - kOrder + 1);
    const Weights across = weights_at(seen.at.col, interval_, cols_ - kOrder + 1);
    total += seen.weight;
    for (int a = 0; a < kOrder * kOrder; ++a) {
      const int ar = a / kOrder, ac = a % kOrder;
      const double wa = seen.weight * down.weight[ar] * across.weight[ac];
      right[static_cast<Eigen::Index>(index(down.first + ar, across.first + ac))] += wa * seen.value;
      for (int b = 0; b < kOrder * kOrder; ++b) {
        const int br = b / kOrder, bc = b % kOrder;
        meet(down.first + ar, across.first + ac, br - ar, bc - ac, wa * down.weight[br] * across.weight[bc]);
      }
    }
  }

  // The penalty, and the matrix.
  const double each = total / static_cast<double>(n);
  std::vector<Entry> entries;
  entries.reserve(near.size() * 60);
  for (int row = 0; row < rows_; ++row)
    for (int col = 0; col < cols_; ++col) {
      entries.emplace_back(index(row, col), index(row, col), kRidge * each);
      for (int dr = -kReach; dr <= kReach; ++dr)
        for (int dc = -kReach; dc <= kReach; ++dc) {
          const double v = near[index(row, col)][(dr + kReach) * kSide + dc + kReach];
          if (v != 0) entries.emplace_back(index(row, col), index(row + dr, col + dc), v);
        }
      for (const bool down : {true, false}) {
        if ((down ? row : col) + 4 >= (down ? rows_ : cols_)) continue;
        for (int a = 0; a < 5; ++a)
          for (int b = 0; b < 5; ++b)
            entries.emplace_back(down ? index(row + a, col) : index(row, col + a),
                                 down ? index(row + b, col) : index(row, col + b),
                                 smoothing * each * kFourthDifference[a] * kFourthDifference[b]);
      }
    }
  Eigen::SparseMatrix<double> matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(matrix);
  if (factor.info() != Eigen::Success) return false;
  const Eigen::VectorXd solution = factor.solve(right);
  if (!solution.allFinite()) return false;
  std::ranges::copy(solution, coefficient_.begin());
  return true;
}

}  // namespace symrig::calibration
