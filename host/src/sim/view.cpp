// SPDX-License-Identifier: Apache-2.0

#include "sim/view.hpp"

#include "sim/scenes.hpp"
#include "symrig/calibration/cell_weights.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <utility>

namespace symrig::sim {

BenchMap::BenchMap(const SceneUri& uri, Depth depth)
    : cells_(uri.size),
      camera_(uri.camera),
      depth_(depth),
      cells_per_pixel_(std::max(static_cast<double>(cells_.rows) / camera_.rows,
                                static_cast<double>(cells_.cols) / camera_.cols)),
      half_diagonal_(0.5 * std::hypot(cells_.rows, cells_.cols)),
      cos_(std::cos(uri.turn * std::numbers::pi / 180)),
      sin_(std::sin(uri.turn * std::numbers::pi / 180)),
      zoom_(uri.zoom),
      distortion_(uri.distortion),
      parallax_(uri.parallax),
      shift_{uri.shift.row + uri.misalign, uri.shift.col + uri.misalign} {
  // Red and blue are `colour` apart at the corner. One channel is the one in the middle.
  if (uri.channels == 3)
    magnify_ = {1 + 0.5 * uri.colour / half_diagonal_, 1, 1 - 0.5 * uri.colour / half_diagonal_};
}

Point BenchMap::look(Point camera, int channel, double moved) const {
  const double y = (camera.row - 0.5 * camera_.rows) * cells_per_pixel_;
  const double x = (camera.col - 0.5 * camera_.cols) * cells_per_pixel_;
  const double from_axis = (y * y + x * x) / (half_diagonal_ * half_diagonal_);
  const double scale = (1 + distortion_ * from_axis) / zoom_ * magnify_[static_cast<std::size_t>(channel)];
  return seen_at({0.5 * cells_.rows + shift_.row + moved + scale * (cos_ * y + sin_ * x),
                  0.5 * cells_.cols + shift_.col + moved + scale * (cos_ * x - sin_ * y)});
}

/// Solves p + (0, parallax · depth(p)) = q. A cell changes the depth little, so each round gains digits.
Point BenchMap::seen_at(Point q) const {
  if (parallax_ == 0) return q;
  Point p = q;
  constexpr int kRounds = 60;
  for (int round = 0; round < kRounds; ++round) {
    const double col = q.col - parallax_ * depth_(cells_, p);
    const bool settled = std::abs(col - p.col) < 1e-12;
    p.col = col;
    if (settled) break;
  }
  return p;
}

namespace {

/// A camera that shares the projector's cells: see = T light.
class CoaxialView final : public CameraView {
 public:
  explicit CoaxialView(std::shared_ptr<const Scene> scene) : scene_(std::move(scene)) {}
  Grid camera() const override { return scene_->grid(); }
  int channels() const override { return scene_->channels(); }
  Image<float> see(const Image<float>& light, std::uint64_t /*shown_before*/) const override {
    return scene_->apply(light);
  }

 private:
  std::shared_ptr<const Scene> scene_;
};

}  // namespace

bool is_bench(const SceneUri& uri) {
  const SceneUri none;
  return uri.own_camera() || uri.turn != 0 || uri.zoom != 1 || uri.shift != none.shift ||
         uri.distortion != 0 || uri.parallax != 0 || uri.vignetting != none.vignetting ||
         uri.defocus != none.defocus || uri.colour != 0 || uri.ghost.share != 0 || uri.moves != 0;
}

Result<Bench> make_bench(const SceneUri& uri) {
  Bench bench;
  if (!is_bench(uri)) {
    SYMRIG_TRY(bench.truth, make_scene(uri));
    bench.view = std::make_unique<CoaxialView>(bench.truth);
    return bench;
  }
  SYMRIG_TRY(auto made, make_points(uri));
  const std::shared_ptr<const Scene> points = std::move(made);
  bench.truth = uri.fine == 1 ? points : cell_scene(uri, points);
  bench.view = bench_view(uri, points);
  return bench;
}

}  // namespace symrig::sim

namespace symrig {

namespace {

/// [cells] From this blur on, edges show it, and a registration measures cells by area.
constexpr double kSharp = 0.09;

/// A photograph without noise.
Radiance exact(Image<float> mean) {
  const Grid grid = mean.grid();
  const int channels = mean.channels();
  return {std::move(mean), Image<float>(grid, channels),
          Image<std::uint8_t>(grid, channels, std::uint8_t{1})};
}

/// The same picture in each channel.
Image<float> spread(const Image<float>& one, int channels) {
  Image<float> all(one.grid(), channels);
  for (int c = 0; c < channels; ++c) std::ranges::copy(one.plane(0), all.plane(c).begin());
  return all;
}

/// c / p with mean log 0. weights: of the exact map.
Result<Image<float>> gain_ratio(const sim::CameraView& view, const CellWeights& weights) {
  SYMRIG_TRY(const Radiance camera, weights.gather(exact(spread(view.camera_gain(), weights.channels()))));
  Image<float> gain = view.projector_gain();
  double sum = 0;
  for (std::size_t i = 0; i < gain.values().size(); ++i) {
    const float c = camera.mean.plane(0)[i];
    gain.values()[i] = c > 0 ? c / gain.values()[i] : 1.F;
    sum += std::log(static_cast<double>(gain.values()[i]));
  }
  const auto mean = static_cast<float>(std::exp(sum / static_cast<double>(gain.values().size())));
  for (float& g : gain.values()) g /= mean;
  return gain;
}

/// The positive (sign = 1) or negative part of a pattern.
Image<float> part_of(const Image<float>& pattern, float sign) {
  Image<float> part(pattern.grid());
  std::ranges::transform(pattern.values(), part.values().begin(),
                         [&](float v) { return std::max(sign * v, 0.F); });
  return part;
}

/// The gain ratio on the cells. A cell's gain is the mean over its area.
Result<Image<float>> exact_gain(const sim::Bench& bench, const std::vector<CornerMap>& corners) {
  const Radiance even = exact(Image<float>(bench.view->camera(), bench.view->channels(), 1.F));
  SYMRIG_TRY(const CellWeights area,
             CellWeights::make(bench.truth->grid(), corners, even, {.weighting = Weighting::area}));
  return gain_ratio(*bench.view, area);
}

/// What the camera lacks of the projector's blur [cells²], by second moments. Weights by area take each of
/// the camera's pixels for light from all of its side w: light moves from anywhere in a pixel to anywhere in
/// it, w² / 6. The scene's points are squares of 1 / N cells for the camera, and points for the projector,
/// which lights N of them in a cell: 2 / (12 N²).
double missing_blur(const SceneUri& uri, const CellWeights& weights) {
  return std::max(0.0, std::pow(uri.defocus.projector, 2) - std::pow(uri.defocus.camera, 2) -
                           std::pow(weights.pixel_side(), 2) / 6 - 1 / (12.0 * uri.fine * uri.fine));
}

}  // namespace

Result<Image<float>> bench_gain(const SceneUri& uri) {
  if (!uri.own_camera()) return Image<float>();
  SYMRIG_TRY(const sim::Bench bench, sim::make_bench(uri));
  return exact_gain(bench, bench.view->corners());
}

Result<std::optional<TrueTransport>> bench_truth(const SceneUri& uri) {
  if (!uri.own_camera()) return std::optional<TrueTransport>();
  SceneUri without_ghost = uri;
  without_ghost.ghost = {};
  SYMRIG_TRY(sim::Bench made, sim::make_bench(without_ghost));
  const auto bench = std::make_shared<sim::Bench>(std::move(made));
  const Grid cells = bench->truth->grid();
  const std::vector<CornerMap> corners = bench->view->corners();
  const Radiance flood = exact(bench->view->see(Image<float>(cells, 1, 1.F), 0));
  const Image<float> shares = bench->view->flood_shares();
  const bool sharp = std::hypot(uri.defocus.camera, uri.defocus.projector) < kSharp;
  const WeightOptions options{.weighting = sharp ? Weighting::cores : Weighting::area, .margin = 0};
  SYMRIG_TRY(CellWeights exact_weights, CellWeights::make(cells, corners, flood, options, &shares));
  if (!sharp) SYMRIG_CHECK(exact_weights.blur_by(missing_blur(uri, exact_weights)));
  SYMRIG_TRY(const Image<float> gain, exact_gain(*bench, corners));
  SYMRIG_CHECK(exact_weights.divide_by(gain));
  const auto weights = std::make_shared<const CellWeights>(std::move(exact_weights));
  return std::optional<TrueTransport>([bench, weights](const Image<float>& pattern) -> Result<Image<float>> {
    // A signed pattern is two photographs: cells do not follow superposition exactly (Weighting::cores).
    SYMRIG_TRY(Radiance seen, weights->gather(exact(bench->view->see(part_of(pattern, 1), 0))));
    if (std::ranges::none_of(pattern.values(), [](float v) { return v < 0; })) return std::move(seen.mean);
    SYMRIG_TRY(const Radiance less, weights->gather(exact(bench->view->see(part_of(pattern, -1), 0))));
    std::ranges::transform(seen.mean.values(), less.mean.values(), seen.mean.values().begin(),
                           std::minus<>());
    return std::move(seen.mean);
  });
}

Result<std::optional<CameraTruth>> camera_truth(const SceneUri& uri) {
  if (!uri.own_camera()) return std::optional<CameraTruth>();
  SYMRIG_TRY(sim::Bench made, sim::make_bench(uri));
  const auto bench = std::make_shared<sim::Bench>(std::move(made));
  const auto photograph = [bench](const Image<float>& pattern) -> Result<Image<float>> {
    Image<float> seen = bench->view->see(part_of(pattern, 1), 0);
    if (std::ranges::none_of(pattern.values(), [](float v) { return v < 0; })) return seen;
    const Image<float> less = bench->view->see(part_of(pattern, -1), 0);
    std::ranges::transform(seen.values(), less.values(), seen.values().begin(), std::minus<>());
    return seen;
  };
  return std::optional(CameraTruth{photograph, bench->view->corners()});
}

}  // namespace symrig
