// SPDX-License-Identifier: Apache-2.0
#include "symrig/sim/scene.hpp"

#include "sim/scenes.hpp"

#include <cassert>
#include <utility>

#include <fmt/format.h>

namespace symrig::sim {
namespace {

/// A scene with one operator per channel.
class ComposedScene final : public Scene {
 public:
  ComposedScene(Grid grid, Channels channels) : grid_(grid), channels_(std::move(channels)) {}

  Grid grid() const override { return grid_; }
  int channels() const override { return static_cast<int>(channels_.size()); }
  void apply(std::span<const float> p, std::span<float> y, int channel) const override {
    channels_[channel]->apply(p, y);
  }

 private:
  Grid grid_;
  Channels channels_;
};

/// The cells of a scene that has fine × fine points in each.
class CellScene final : public Scene {
 public:
  CellScene(Grid cells, int fine, double psf, std::shared_ptr<const Scene> points)
      : cells_(cells), fine_(fine), psf_(static_cast<float>(psf)), points_(std::move(points)) {}

  Grid grid() const override { return cells_; }
  int channels() const override { return points_->channels(); }
  void apply(std::span<const float> p, std::span<float> y, int channel) const override {
    const Grid points = points_->grid();
    std::vector<float> sharp(p.begin(), p.end());
    if (psf_ > 0) blur_3tap(cells_, psf_, sharp);
    std::vector<float> lit(static_cast<std::size_t>(points.size())), radiance(lit.size());
    for (std::size_t i = 0; i < lit.size(); ++i) lit[i] = sharp[cell_of(i)];
    points_->apply(lit, radiance, channel);
    std::vector<double> sum(y.size());
    for (std::size_t i = 0; i < lit.size(); ++i) sum[cell_of(i)] += static_cast<double>(radiance[i]);
    for (std::size_t i = 0; i < y.size(); ++i) y[i] = static_cast<float>(sum[i] / (fine_ * fine_));
    if (psf_ > 0) blur_3tap(cells_, psf_, y);
  }

 private:
  std::size_t cell_of(std::size_t point) const {
    const std::size_t cols = points_->grid().cols, fine = fine_;
    return point / cols / fine * static_cast<std::size_t>(cells_.cols) + point % cols / fine;
  }

  Grid cells_;
  int fine_;
  float psf_;
  std::shared_ptr<const Scene> points_;
};

/// A scene that others have, too.
class BorrowedScene final : public Scene {
 public:
  explicit BorrowedScene(std::shared_ptr<const Scene> scene) : scene_(std::move(scene)) {}

  Grid grid() const override { return scene_->grid(); }
  int channels() const override { return scene_->channels(); }
  void apply(std::span<const float> p, std::span<float> y, int channel) const override {
    scene_->apply(p, y, channel);
  }

 private:
  std::shared_ptr<const Scene> scene_;
};

/// The grid of a scene's points.
Grid points_of(const SceneUri& uri) {
  return {uri.size.rows * uri.fine, uri.size.cols * uri.fine};
}

Result<void> check_size(const SceneUri& uri) {
  if (!uri.size.valid())
    return Error{ErrorCode::bad_argument, fmt::format("size={} is empty or too large", to_string(uri.size)),
                 "give at least 1x1"};
  if (uri.own_camera() && uri.camera.size() > kLargestScene)
    return Error{ErrorCode::limit,
                 fmt::format("camera={} has more than {} pixels", to_string(uri.camera), kLargestScene),
                 "give a smaller camera, such as 4096x4096"};
  const std::int64_t per_cell = std::int64_t{uri.fine} * uri.fine;
  if (uri.size.size() <= kLargestScene / per_cell) return {};
  if (uri.fine == 1)
    return Error{ErrorCode::limit,
                 fmt::format("size={} has more than {} pixels", to_string(uri.size), kLargestScene),
                 "give a smaller grid, such as 4096x4096"};
  return Error{ErrorCode::limit,
               fmt::format("size={} with fine={} has more than {} points", to_string(uri.size), uri.fine,
                           kLargestScene),
               "give a smaller grid, or fewer points a cell"};
}

}  // namespace

Result<std::unique_ptr<Scene>> make_points(const SceneUri& uri) {
  SYMRIG_CHECK(check_size(uri));
  if (uri.given) return std::unique_ptr<Scene>(std::make_unique<BorrowedScene>(uri.given->points));
  const SceneRow* row = find_scene(uri.name);
  if (row == nullptr) return unknown_scene(uri.name);
  SceneUri points = uri;
  points.size = points_of(uri);
  return std::unique_ptr<Scene>(std::make_unique<ComposedScene>(points.size, row->make(points)));
}

std::unique_ptr<Scene> cell_scene(const SceneUri& uri, std::shared_ptr<const Scene> points) {
  return std::make_unique<CellScene>(uri.size, uri.fine, uri.psf, std::move(points));
}

}  // namespace symrig::sim

namespace symrig {

Image<float> Scene::apply(const Image<float>& pattern) const {
  assert(pattern.grid() == grid() && pattern.channels() == 1);
  Image<float> photograph(grid(), channels());
  for (int c = 0; c < channels(); ++c) apply(pattern.plane(0), photograph.plane(c), c);
  return photograph;
}

ViewLayout views_of(const SceneUri& uri) {
  if (uri.given) return uri.given->views;
  const sim::SceneRow* row = sim::find_scene(uri.name);
  return row == nullptr ? ViewLayout() : row->views;
}

Result<std::unique_ptr<Scene>> make_scene(const SceneUri& uri) {
  if (uri.fine == 1 && uri.psf == 0) return sim::make_points(uri);
  SYMRIG_TRY(auto points, sim::make_points(uri));
  return sim::cell_scene(uri, std::move(points));
}

}  // namespace symrig
