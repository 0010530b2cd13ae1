// SPDX-License-Identifier: Apache-2.0
#include "symrig/sim/bench_truth.hpp"

#include "sim/view.hpp"
#include "symrig/calibration/cell_weights.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <utility>

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
Result<Image<float>> gain_ratio(const sim::View& view, const CellWeights& weights) {
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

}  // namespace symrig
