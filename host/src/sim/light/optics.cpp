// SPDX-License-Identifier: Apache-2.0

#include "sim/light/optics.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace symrig::sim {

void Optics::add(std::int64_t point, float weight) {
  point_.push_back(static_cast<std::uint32_t>(point));
  weight_.push_back(weight);
}

void Optics::see(std::span<const float> scene, std::span<float> seen) const {
  std::size_t entry = 0;
  for (std::size_t pixel = 0; pixel < end_.size(); ++pixel) {
    float sum = 0;
    for (; entry < end_[pixel]; ++entry) sum += weight_[entry] * scene[point_[entry]];
    seen[pixel] = sum;
  }
}

void Optics::light(std::span<const float> light, std::span<float> lit) const {
  std::fill(lit.begin(), lit.end(), 0.F);
  add_light(light, lit);
}

void Optics::add_light(std::span<const float> light, std::span<float> lit) const {
  std::size_t entry = 0;
  for (std::size_t pixel = 0; pixel < end_.size(); ++pixel)
    for (; entry < end_[pixel]; ++entry) lit[point_[entry]] += weight_[entry] * light[pixel];
}

namespace {

class SeenThrough final : public Transport {
 public:
  SeenThrough(std::shared_ptr<const Optics> optics, std::unique_ptr<Transport> scene)
      : optics_(std::move(optics)), scene_(std::move(scene)) {}

  void apply(std::span<const float> x, std::span<float> y) const override {
    std::vector<float> lit(optics_->scene_points());
    std::vector<float> radiosity(optics_->scene_points());
    optics_->light(x, lit);
    scene_->apply(lit, radiosity);
    optics_->see(radiosity, y);
  }

 private:
  std::shared_ptr<const Optics> optics_;
  std::unique_ptr<Transport> scene_;
};

struct Cell {
  int index;
  float weight;
};

/// The two samples around coordinate x (sample i has its centre at i + ½), clamped to [0, n).
std::pair<Cell, Cell> linear(double x, int n) {
  const double at = std::clamp(x - 0.5, 0.0, n - 1.0);
  const int low = std::min(static_cast<int>(at), std::max(0, n - 2));
  const auto share = static_cast<float>(at - low);
  return {{low, 1 - share}, {std::min(low + 1, n - 1), share}};
}

/// Adds `weight` of the point (y, x), split over the four pixels around it.
void add_bilinear(Optics& optics, Grid scene, double y, double x, float weight) {
  const auto [top, bottom] = linear(y, scene.rows);
  const auto [left, right] = linear(x, scene.cols);
  for (const Cell& row : {top, bottom})
    for (const Cell& col : {left, right})
      if (row.weight * col.weight > 0)
        optics.add(std::int64_t{row.index} * scene.cols + col.index, weight * row.weight * col.weight);
}

// The mirror, in shares of the picture.
constexpr double kMirrorRow = 0.58, kMirrorCol = 0.73, kMirrorHalfHeight = 0.19, kMirrorHalfWidth = 0.13;
constexpr double kReflectance = 0.85;
/// Focal length divided by the distance from the mirror's middle to the left plane. Rays cross before the
/// plane.
constexpr double kFocus = 0.6;
constexpr double kRippleSlope = 0.03;  // of the surface normal
constexpr double kRipples = 2.3;       // over the mirror's half height
constexpr int kRays = 2;               // per pixel and axis

struct Vec {
  double x, y, z;
};

double dot(const Vec& a, const Vec& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

/// Unit normal of the curved mirror at v, w from its middle. v is along y, w along the plane away from the
/// crease.
Vec mirror_normal(const Groove& groove, double v, double w) {
  const double middle =
      kMirrorCol * groove.grid.cols - groove.crease;  // distance of its middle from the crease
  const double focal = kFocus * 2 * middle;
  const double ripple = kRippleSlope * std::sin(kRipples * 3.0 * v / (kMirrorHalfHeight * groove.grid.rows));
  const double tilt_y = -v / (2 * focal) + ripple;
  const double tilt_w = -w / (2 * focal);
  const Vec n{kForeshortening * (-1 + tilt_w), tilt_y, kForeshortening * (1 + tilt_w)};
  const double length = std::sqrt(dot(n, n));
  return {n.x / length, n.y / length, n.z / length};
}

/// Follows a ray of the rig that hits the mirror at (y, x). If it then hits the left plane, adds that point.
/// Geometry: x to the right of the crease, y down, z towards the rig; the planes are z = |x|.
void add_reflected_ray(Optics& optics, const Groove& groove, double y, double x, float weight) {
  const double t = x - groove.crease;
  const double w = (x - kMirrorCol * groove.grid.cols) / kForeshortening;
  const Vec n = mirror_normal(groove, y - kMirrorRow * groove.grid.rows, w);
  const Vec ray{2 * n.z * n.x, 2 * n.z * n.y, 2 * n.z * n.z - 1};  // (0, 0, −1) reflected
  const double approach = -(ray.x + ray.z);
  if (approach <= 0) return;
  const double length = 2 * t / approach;
  const double row = y + length * ray.y;
  const double col = groove.crease + t + length * ray.x;
  if (row < 0 || row > groove.grid.rows || col < 0 || col > groove.left_cols) return;
  add_bilinear(optics, groove.grid, row, std::min(col, groove.left_cols - 0.5), weight);
}

void add_mirror_pixel(Optics& optics, const Groove& groove, int row, int col) {
  const auto weight = static_cast<float>(kReflectance / (kRays * kRays));
  for (int i = 0; i < kRays; ++i)
    for (int j = 0; j < kRays; ++j)
      add_reflected_ray(optics, groove, row + (i + 0.5) / kRays, col + (j + 0.5) / kRays, weight);
}

constexpr double kParallax = 0.12;

/// The position of a pixel along one axis: its view, and its scene coordinate before parallax.
struct TilePosition {
  double offset;  ///< of the view from the middle view
  double at;      ///< scene coordinate
};

/// View k has the cells [k n / views, (k + 1) n / views) of n. A cell has `fine` pixels.
TilePosition tile_position(std::int64_t pixel, std::int64_t pixels, std::int64_t views, int scene,
                           std::int64_t fine) {
  const std::int64_t n = pixels / fine;
  const std::int64_t k = ((pixel / fine + 1) * views - 1) / n;
  const std::int64_t begin = k * n / views * fine;
  const std::int64_t end = (k + 1) * n / views * fine;
  const double scale = scene / static_cast<double>(end - begin);
  return {static_cast<double>(k) - 0.5 * static_cast<double>(views - 1),
          (static_cast<double>(pixel - begin) + 0.5) * scale};
}

/// The x at which a view with this offset sees column x of its tile: x = p + k (|p − crease| − mean), solved
/// for p on each side of the crease.
double seen_column(double x, double crease, double mean, double k) {
  const double from_crease = x + k * mean - crease;  // = d + k |d|
  return crease + from_crease / (from_crease < 0 ? 1 - k : 1 + k);
}

}  // namespace

std::unique_ptr<Transport> seen_through(std::shared_ptr<const Optics> optics,
                                        std::unique_ptr<Transport> scene) {
  return std::make_unique<SeenThrough>(std::move(optics), std::move(scene));
}

bool on_mirror(const Groove& groove, int row, int col) {
  if (col < groove.left_cols) return false;
  const double v = ((row + 0.5) / groove.grid.rows - kMirrorRow) / kMirrorHalfHeight;
  const double u = ((col + 0.5) / groove.grid.cols - kMirrorCol) / kMirrorHalfWidth;
  return v * v + u * u < 1;
}

Optics mirror_patch(const Groove& groove) {
  Optics optics(static_cast<std::size_t>(groove.grid.size()));
  for (int row = 0; row < groove.grid.rows; ++row) {
    for (int col = 0; col < groove.grid.cols; ++col) {
      if (on_mirror(groove, row, col))
        add_mirror_pixel(optics, groove, row, col);
      else
        optics.add(std::int64_t{row} * groove.grid.cols + col, 1);
      optics.end_pixel();
    }
  }
  return optics;
}

TiledViews tiled_views(Grid grid, ViewLayout views, int fine) {
  const Grid scene{(grid.rows + views.rows - 1) / views.rows, (grid.cols + views.cols - 1) / views.cols};
  const auto share = static_cast<float>(1 / std::sqrt(static_cast<double>(views.count())));
  const Groove groove(scene);
  const double mean = 0.25 * scene.cols;  // depth at which parallax is zero
  TiledViews tiled{scene, Optics(static_cast<std::size_t>(scene.size())), Image<float>(grid, 2)};
  for (int row = 0; row < grid.rows; ++row) {
    const TilePosition v = tile_position(row, grid.rows, views.rows, scene.rows, fine);
    for (int col = 0; col < grid.cols; ++col) {
      const TilePosition u = tile_position(col, grid.cols, views.cols, scene.cols, fine);
      const double x = seen_column(u.at, groove.crease, mean, kParallax * u.offset);
      const double y = v.at - kParallax * v.offset * (std::abs(x - groove.crease) - mean);
      if (y >= 0 && y <= scene.rows && x >= 0 && x <= scene.cols)
        add_bilinear(tiled.optics, scene, y, x, share);
      tiled.optics.end_pixel();
      tiled.surface.at(row, col, 0) = static_cast<float>(y);
      tiled.surface.at(row, col, 1) = static_cast<float>(x);
    }
  }
  return tiled;
}

}  // namespace symrig::sim
