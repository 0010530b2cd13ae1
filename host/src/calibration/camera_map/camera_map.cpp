// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/camera_map.hpp"

#include "calibration/camera_map/camera_map_surfaces.hpp"
#include "calibration/fitting/least_squares.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Dense>
#include <tbb/parallel_for.h>

namespace symrig {

using calibration::blur_of_edge;
using calibration::SeenValue;
using calibration::SplineSurface;

namespace {

/// The surface of an axis. coefficients: as many as the surface has, each within reach of the cells.
std::optional<SplineSurface> surface_of(Grid camera, int intervals, std::span<const double> coefficients) {
  constexpr double kFarthest = 1e7;  // [cells]
  SplineSurface surface(camera, intervals);
  const auto to = surface.coefficients();
  const bool good = coefficients.size() == to.size() &&
                    std::ranges::all_of(coefficients, [](double v) { return std::abs(v) < kFarthest; });
  if (!good) return std::nullopt;
  std::ranges::copy(coefficients, to.begin());
  return surface;
}

bool is_share(double v) {
  return v >= 0 && v <= 1;
}

}  // namespace

Result<CameraMap> CameraMap::make(const CameraMapNumbers& n) {
  const Error wrong{ErrorCode::bad_value, "the numbers of a camera's map do not fit together",
                    "register the camera again"};
  // The limits keep a hostile file from asking for memory that it does not fill.
  if (!n.camera.valid() || n.intervals < 1 || n.intervals > 4 * CameraMap::kMostIntervals) return wrong;
  if (!(n.error >= 0 && n.error <= 1e3 && n.edge_width >= 0 && n.edge_width <= 1e3) || n.edges < 0 ||
      !is_share(n.outlier_share))
    return wrong;
  auto row = surface_of(n.camera, n.intervals, n.row), col = surface_of(n.camera, n.intervals, n.col);
  if (!row || !col) return wrong;
  CameraMap map;
  map.camera_ = n.camera;
  map.error_ = n.error;
  map.edge_width_ = n.edge_width;
  map.outlier_share_ = n.outlier_share;
  map.edges_ = n.edges;
  map.surfaces_ =
      std::make_shared<CameraMap::Surfaces>(CameraMap::Surfaces{*std::move(row), *std::move(col)});
  return map;
}

CameraMapNumbers CameraMap::numbers() const {
  const auto row = std::as_const(surfaces_->row).coefficients();
  const auto col = std::as_const(surfaces_->col).coefficients();
  return {.camera = camera_,
          .intervals = surfaces_->row.intervals(),
          .row = {row.begin(), row.end()},
          .col = {col.begin(), col.end()},
          .error = error_,
          .edge_width = edge_width_,
          .outlier_share = outlier_share_,
          .edges = edges_};
}

Point CameraMap::look(Point camera) const {
  return {surfaces_->row(camera), surfaces_->col(camera)};
}

CornerMap CameraMap::corners() const {
  CornerMap corners({camera_.rows + 1, camera_.cols + 1}, 2);
  tbb::parallel_for(0, camera_.rows + 1, [&](int row) {
    for (int col = 0; col <= camera_.cols; ++col) {
      const Point at = look({static_cast<double>(row), static_cast<double>(col)});
      corners.at(row, col, 0) = at.row;
      corners.at(row, col, 1) = at.col;
    }
  });
  return corners;
}

CameraMap CameraMap::shifted(const std::function<Point(Point)>& shift) const {
  constexpr int kLeastIntervals = 24, kSamples = 3;  // samples in an interval
  constexpr double kSmoothing = 1e-9;                // samples have no noise
  // A multiple of the intervals: so the spline of this map is one of those.
  const int now = surfaces_->row.intervals();
  const int intervals = now * ((kLeastIntervals + now - 1) / now);
  const double step = static_cast<double>(std::max(camera_.rows, camera_.cols)) / (kSamples * intervals);
  std::vector<SeenValue> rows, cols;
  const int down = static_cast<int>(std::ceil(camera_.rows / step)),
            right = static_cast<int>(std::ceil(camera_.cols / step));
  for (int row = 0; row <= down; ++row)
    for (int col = 0; col <= right; ++col) {
      const Point at{std::min<double>(row * step, camera_.rows), std::min<double>(col * step, camera_.cols)};
      const Point to = look(at), more = shift(to);
      rows.push_back({at, to.row + more.row});
      cols.push_back({at, to.col + more.col});
    }
  Surfaces moved{SplineSurface(camera_, intervals), SplineSurface(camera_, intervals)};
  CameraMap map = *this;
  if (moved.row.fit(rows, kSmoothing) && moved.col.fit(cols, kSmoothing))
    map.surfaces_ = std::make_shared<Surfaces>(std::move(moved));
  return map;
}

std::array<Point, 2> CameraMap::step() const {
  const Point middle{0.5 * camera_.rows, 0.5 * camera_.cols};
  const Point here = look(middle), down = look({middle.row + 1, middle.col}),
              right = look({middle.row, middle.col + 1});
  return {Point{down.row - here.row, down.col - here.col}, Point{right.row - here.row, right.col - here.col}};
}

double CameraMap::pixels_per_cell() const {
  const auto [down, right] = step();
  return 1 / std::sqrt(std::abs(down.row * right.col - right.row * down.col));
}

double CameraMap::edge_blur() const {
  const auto [down, right] = step();
  const double rows = std::abs(down.row) + std::abs(right.row),
               cols = std::abs(down.col) + std::abs(right.col);
  return blur_of_edge(edge_width_, std::max(rows, cols));
}

Image<float> CameraMap::bend(Grid cells) const {
  const auto inside = [&](const Eigen::RowVector2d& at) {
    return at[0] >= 0 && at[1] >= 0 && at[0] <= cells.rows && at[1] <= cells.cols;
  };
  const auto ray = [](int row, int col) { return Eigen::Vector3d(1, row + 0.5, col + 0.5); };
  const auto seen = [&](int row, int col) {
    const Point at = look({row + 0.5, col + 0.5});
    return Eigen::RowVector2d(at.row, at.col);
  };
  // The affine map, by least squares over a lattice of pixels: it has six numbers.
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 2> right = Eigen::Matrix<double, 3, 2>::Zero();
  const int step = std::max(1, std::max(camera_.rows, camera_.cols) / 100);
  for (int row = 0; row < camera_.rows; row += step)
    for (int col = 0; col < camera_.cols; col += step) {
      const Eigen::RowVector2d at = seen(row, col);
      if (!inside(at)) continue;
      normal += ray(row, col) * ray(row, col).transpose();
      right += ray(row, col) * at;
    }
  const Eigen::Matrix<double, 3, 2> affine = calibration::solve_normal(normal, right);
  Image<float> bent(camera_);
  tbb::parallel_for(0, camera_.rows, [&](int row) {
    for (int col = 0; col < camera_.cols; ++col)
      if (const Eigen::RowVector2d at = seen(row, col); inside(at))
        bent.at(row, col) = static_cast<float>((at - ray(row, col).transpose() * affine).norm());
  });
  return bent;
}

}  // namespace symrig
