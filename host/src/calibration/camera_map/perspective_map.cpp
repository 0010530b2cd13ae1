// SPDX-License-Identifier: Apache-2.0
#include "calibration/camera_map/perspective_map.hpp"

#include "calibration/fitting/least_squares.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/calibration/camera_map.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Dense>

namespace symrig::calibration {
namespace {

/// Each round gains digits.
constexpr int kNewtonRounds = 20;
/// Prior of perspective and distortion, by the weight of one coordinate: they are 0 ± 0.3 where a coordinate
/// is known to 0.02 cells. Some hundred coordinates count far more.
constexpr double kPrior = 0.005;
/// An end of the picture, where its scale is compared with that of the other end.
constexpr double kEnd = 0.9;

}  // namespace

PerspectiveMap::PerspectiveMap(Grid camera)
    : middle_{0.5 * camera.rows, 0.5 * camera.cols},
      half_diagonal_(0.5 * std::hypot(camera.rows, camera.cols)) {}

Eigen::Vector2d PerspectiveMap::scaled(Point at) const {
  return {(at.row - middle_.row) / half_diagonal_, (at.col - middle_.col) / half_diagonal_};
}

Eigen::Vector2d PerspectiveMap::model(const Eigen::Vector2d& at) const {
  const Eigen::Vector2d p = at * (1 + n_[8] * at.squaredNorm());
  const double w = n_[6] * p[0] + n_[7] * p[1] + 1;
  return {(n_[0] * p[0] + n_[1] * p[1] + n_[2]) / w, (n_[3] * p[0] + n_[4] * p[1] + n_[5]) / w};
}

Point PerspectiveMap::look(Point at) const {
  const Eigen::Vector2d to = model(scaled(at));
  return {to[0], to[1]};
}

/// ∂ cell / ∂ bent.
Eigen::Matrix2d PerspectiveMap::perspective_slopes(const Eigen::Vector2d& bent,
                                                   const Eigen::Vector2d& cell) const {
  Eigen::Matrix2d j;
  j << n_[0] - cell[0] * n_[6], n_[1] - cell[0] * n_[7], n_[3] - cell[1] * n_[6], n_[4] - cell[1] * n_[7];
  return j / (n_[6] * bent[0] + n_[7] * bent[1] + 1);
}

/// ∂ model / ∂ at.
Eigen::Matrix2d PerspectiveMap::step_at(const Eigen::Vector2d& at) const {
  const double stretch = 1 + n_[8] * at.squaredNorm();
  const Eigen::Matrix2d bend = stretch * Eigen::Matrix2d::Identity() + 2 * n_[8] * at * at.transpose();
  return perspective_slopes(stretch * at, model(at)) * bend;
}

/// ∂ model / ∂ numbers.
Eigen::Matrix<double, 2, 9> PerspectiveMap::slopes(const Eigen::Vector2d& at) const {
  const double r2 = at.squaredNorm();
  const Eigen::Vector2d p = at * (1 + n_[8] * r2), q = model(at);
  const Eigen::RowVector3d ray = Eigen::RowVector3d(p[0], p[1], 1) / (n_[6] * p[0] + n_[7] * p[1] + 1);
  Eigen::Matrix<double, 2, 9> j = Eigen::Matrix<double, 2, 9>::Zero();
  j.block<1, 3>(0, 0) = ray;
  j.block<1, 3>(1, 3) = ray;
  j.block<2, 2>(0, 6) = -q * ray.head<2>();
  j.col(8) = perspective_slopes(p, q) * at * r2;
  return j;
}

// Gauss and Newton on Σ w (value − model)² + kPrior (h31² + h32² + k²). With u in half diagonals from the
// middle, p = u (1 + k |u|²), and model(u) = (h11 p₁ + h12 p₂ + h13, h21 p₁ + h22 p₂ + h23) / (h31 p₁ + h32
// p₂ + 1). Each round solves the normal equations Jᵀ W J step = Jᵀ W rest, with the derivatives J of
// slopes().
void PerspectiveMap::fit(std::span<const SeenCoordinate> seen) {
  n_.setZero();
  for (int round = 0; round < kNewtonRounds; ++round) {
    Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
    Numbers right = Numbers::Zero();
    for (const SeenCoordinate& one : seen) {
      if (one.weight == 0) continue;
      const Eigen::Vector2d at = scaled(one.at);
      const int axis = one.axis == StripeAxis::rows ? 0 : 1;
      const Eigen::Matrix<double, 1, 9> j = slopes(at).row(axis);
      normal += one.weight * j.transpose() * j;
      right += one.weight * (one.value - model(at)[axis]) * j.transpose();
    }
    normal.diagonal().tail<3>().array() += kPrior;
    right.tail<3>() -= kPrior * n_.tail<3>();
    // The first round is the affine map: perspective and distortion are small beside it.
    if (round == 0) {
      normal.bottomRows<3>().setZero();
      normal.rightCols<3>().setZero();
      normal.bottomRightCorner<3, 3>().setIdentity();
      right.tail<3>().setZero();
    }
    const Numbers step = solve_normal(normal, right);
    if (!step.allFinite()) return;
    n_ += step;
    if (round > 0 && step.norm() < 1e-12 * (1 + n_.norm())) return;
  }
}

/// Cells along a step of one half diagonal, at a point: the root of the area.
double PerspectiveMap::scale_at(double row, double col) const {
  return std::sqrt(std::abs(step_at({row, col}).determinant()));
}

void PerspectiveMap::describe(Grid cells, MapShape& shape) const {
  const Eigen::Vector2d middle = model({0, 0});
  shape.shift = {middle[0] - 0.5 * cells.rows, middle[1] - 0.5 * cells.cols};
  // A step to the right goes down on the cells if the camera is turned clockwise. A mirrored picture is
  // turned after it is mirrored back.
  const Eigen::Matrix2d step = step_at({0, 0});
  shape.mirrored = step.determinant() < 0;
  const Eigen::Vector2d down = step.col(0), right = (shape.mirrored ? -1 : 1) * step.col(1);
  shape.turn = 180 / std::numbers::pi * std::atan2(right[0] - down[1], right[1] + down[0]);
  shape.pixels_per_cell = half_diagonal_ / scale_at(0, 0);
  const double last_row = kEnd * middle_.row / half_diagonal_, last_col = kEnd * middle_.col / half_diagonal_;
  shape.keystone_rows = scale_at(last_row, 0) / scale_at(-last_row, 0) - 1;
  shape.keystone_cols = scale_at(0, last_col) / scale_at(0, -last_col) - 1;
  shape.distortion = n_[8];
  shape.straight = [map = *this](Point at) { return map.look(at); };
}

Parallax parallax_of(const Image<float>& rest) {
  std::vector<Eigen::Vector2d> left;
  for (int row = 0; row < rest.grid().rows; ++row)
    for (int col = 0; col < rest.grid().cols; ++col)
      if (rest.at(row, col, 2) != 0) left.emplace_back(rest.at(row, col, 0), rest.at(row, col, 1));
  if (left.empty()) return {};
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const auto& v : left) spread += v * v.transpose() / static_cast<double>(left.size());
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver;
  solver.computeDirect(spread);
  Eigen::Vector2d direction = solver.eigenvectors().col(1);
  // The direction has no sign: its larger component points to larger rows or columns.
  if (direction[std::abs(direction[0]) > std::abs(direction[1]) ? 0 : 1] < 0) direction = -direction;
  std::vector<double> along;
  along.reserve(left.size());
  for (const auto& v : left) along.push_back(direction.dot(v));
  Parallax found;
  found.range = quantile(along, 0.95) - quantile(along, 0.05);
  found.direction = {direction[0], direction[1]};
  found.along = std::sqrt(std::max(0.0, solver.eigenvalues()[1]));
  found.across = std::sqrt(std::max(0.0, solver.eigenvalues()[0]));
  return found;
}

}  // namespace symrig::calibration

namespace symrig {

using calibration::PerspectiveMap;
using calibration::SeenCoordinate;

namespace {

/// Points along the longer side of the picture.
constexpr int kLattice = 32;

}  // namespace

Grid shape_lattice(Grid camera, int longer_side) {
  const double most = std::max(camera.rows, camera.cols);
  const auto points = [most, longer_side](int side) {
    return std::max(2, static_cast<int>(std::lround(longer_side * side / most)));
  };
  return {points(camera.rows), points(camera.cols)};
}

MapShape shape_of(Grid camera, const Look& look, Grid cells, const std::function<bool(Point)>& known) {
  // Of a few bright spots, nobody can tell a shape: then the guess counts as well.
  constexpr std::size_t kFewest = 60;
  struct Seen {
    int row, col;  // on the lattice
    Point from, to;
    bool known;
  };
  const Grid lattice = shape_lattice(camera, kLattice);
  std::vector<Seen> seen;
  for (int row = 0; row < lattice.rows; ++row)
    for (int col = 0; col < lattice.cols; ++col) {
      const Point from{(row + 0.5) * camera.rows / lattice.rows, (col + 0.5) * camera.cols / lattice.cols};
      const Point to = look(from);
      if (!(to.row >= 0 && to.col >= 0 && to.row <= cells.rows && to.col <= cells.cols)) continue;
      seen.push_back({row, col, from, to, !known || known(from)});
    }
  MapShape shape;
  const auto known_points = static_cast<std::size_t>(std::ranges::count(seen, true, &Seen::known));
  if (!seen.empty()) shape.guessed = 1 - static_cast<double>(known_points) / static_cast<double>(seen.size());
  if (known_points >= kFewest) std::erase_if(seen, [](const Seen& one) { return !one.known; });
  std::vector<SeenCoordinate> coordinates;
  for (const Seen& one : seen) {
    coordinates.push_back({one.from, StripeAxis::rows, one.to.row});
    coordinates.push_back({one.from, StripeAxis::columns, one.to.col});
  }
  PerspectiveMap map(camera);
  map.fit(coordinates);
  shape.rest = Image<float>(lattice, 3);
  for (const Seen& one : seen) {
    const Point straight = map.look(one.from);
    shape.rest.at(one.row, one.col, 0) = static_cast<float>(one.to.row - straight.row);
    shape.rest.at(one.row, one.col, 1) = static_cast<float>(one.to.col - straight.col);
    shape.rest.at(one.row, one.col, 2) = 1;
  }
  map.describe(cells, shape);
  shape.parallax = calibration::parallax_of(shape.rest);
  return shape;
}

}  // namespace symrig
